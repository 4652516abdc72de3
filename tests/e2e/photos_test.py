"""Photos of phones and images of industrial cameras."""
import os
import subprocess

import films
import harness
import numpy as np
import pytest
from harness import must_run, oaslam

CLIP = os.path.join(harness.SAMPLE, "map_front")
CAMERA = f"{CLIP}/camera.yaml"


def can_encode(codec):
    listed = subprocess.run(["ffmpeg", "-hide_banner", "-encoders"], capture_output=True, text=True).stdout
    return codec in listed


class TestPhotos(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.film = films.read(f"{CLIP}/video.mp4", 60)

    def pgm(self, name, grey, bits):
        """Images with so many bits of data in 16."""
        os.mkdir(self.path(name))
        for i, image in enumerate(grey):
            with open(self.path(f"{name}/{i:03d}.pgm"), "wb") as f:
                f.write(f"P5\n{image.shape[1]} {image.shape[0]}\n65535\n".encode() + (image.astype(">u2") * 2 ** (bits - 8)).tobytes())
        return self.path(name)

    @pytest.mark.skipif(not can_encode("libaom-av1"), reason="ffmpeg writes no AVIF here")
    def test_avif_is_found_in_a_map(self):
        photos = self.path("photos")
        os.mkdir(photos)
        for i, at in enumerate((1, 3, 5)):
            subprocess.run(["ffmpeg", "-v", "error", "-nostdin", "-ss", str(at), "-i", f"{CLIP}/video.mp4", "-frames:v", "1", "-c:v", "libaom-av1", "-crf", "20",
                            "-cpu-used", "8", f"{photos}/{i}.avif"], check=True)
        with open(f"{photos}/1.avif", "r+b") as f:
            f.truncate(700)
        done = must_run("localize", "--map", harness.DESK_MAP, "--images", photos, "--camera", CAMERA, "--every-frame", "--out", self.path("found"))
        assert "image 1 (1.avif): missing or unreadable, skipped" in done.err, done
        assert [f["status"] for f in harness.read_csv(self.path("found/frames.csv"))] == ["points", "points"]

    def test_twelve_bits_in_sixteen_give_the_same_poses(self):
        grey = self.film.astype(float).mean(axis=3).round().astype(np.uint16)
        out = []
        for bits in (8, 12):
            source = self.pgm(f"bits{bits}", grey, bits)
            out.append(self.path(f"bits{bits}.txt"))
            done = must_run("odometry", source, "--camera", CAMERA, "--out", out[-1])
            assert done.err.count(f"{bits} of the 16 bits of its images are used") == 1, done
        assert harness.read_bytes(out[0]) == harness.read_bytes(out[1])
        assert len(harness.read_tum(out[0])) > 50

    def test_bayer_images_are_refused(self):
        mosaic = self.film[:3, :, :, 0].copy()
        # Green sees more light than blue and red.
        mosaic[:, ::2, ::2] = self.film[:3, ::2, ::2, 2] * 0.5
        mosaic[:, 1::2, 1::2] = self.film[:3, 1::2, 1::2, 0] * 0.7
        mosaic[:, ::2, 1::2] = self.film[:3, ::2, 1::2, 1]
        mosaic[:, 1::2, ::2] = self.film[:3, 1::2, ::2, 1]
        grey = self.film[:3].mean(axis=3).astype(np.uint8)
        raw = self.path("raw")
        os.mkdir(raw)
        with open(f"{raw}/IMG_1.NEF", "wb") as f:
            f.write(b"MM\0*")
        for source, name in ((self.pgm("mosaic", mosaic, 12), "000.pgm"), (self.pgm("bayer_rggb16", grey, 12), "000.pgm"), (raw, "IMG_1.NEF")):
            outcome = oaslam("run", "--images", source, "--camera", CAMERA, "--out", self.path("no"))
            assert outcome.code == 1 and f"{source}/{name}: is the data of a sensor (Bayer)" in outcome.err and "develop" in outcome.err, outcome
            assert not os.path.exists(self.path("no"))
