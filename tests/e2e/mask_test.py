"""Parts of the images that move with the camera: given, found, and not found where there is none."""
import os

import films
import harness
import numpy as np
import pytest
from harness import must_run, oaslam

VIDEO = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
CAMERA = os.path.join(harness.SAMPLE, "map_front", "camera.yaml")
LEFT_OUT = "a part of the images moves with the camera"


def film(path, draw):
    """Images of the sample, each changed by `draw`."""
    images = films.read(VIDEO, 300).copy()
    for image in images:
        draw(image)
    return films.write(path, images)


def texture(height, width, seed=3):
    """Rough noise, as rust and rivets."""
    noise = np.random.default_rng(seed).integers(30, 220, (height // 5 + 1, width // 5 + 1, 3), dtype=np.uint8)
    return noise.repeat(5, 0).repeat(5, 1)[:height, :width]


def grey(shape, value):
    return np.full((1, *shape, 3), value, np.uint8)


def bonnet(image):
    image[336:] = texture(144, 640)


def overlay(image):
    image[20:130, 30:250] = texture(110, 220)


def chassis(image):
    image[300:, :200] = texture(180, 200)
    image[300:, 440:] = texture(180, 200, 5)


class TestMask(harness.InFolder):
    def ate(self, *args):
        done = must_run("run", "--camera", CAMERA, "--out", self.path("out"), "--groundtruth", harness.groundtruth("map_front"), *args)
        summary = harness.read_json(self.path("out/summary.json"))
        assert summary["tracked"] > 0.95 * summary["frames"]
        return summary["ate"], done.err

    @pytest.mark.parametrize("part", [bonnet, overlay, chassis], ids=lambda f: f.__name__)
    def test_is_found_and_left_out(self, part):
        ate, said = self.ate("--images", film(self.path(f"{part.__name__}.mp4"), part))
        assert LEFT_OUT in said
        assert ate < 0.01

    def test_is_given(self):
        images = film(self.path("bonnet.mp4"), bonnet)
        mask = grey((480, 640), 255)
        mask[0, 336:] = 0
        films.write(self.path("mask.png"), mask)
        ate, said = self.ate("--images", images, "--mask", self.path("mask.png"))
        assert LEFT_OUT not in said
        assert ate < 0.01
        must_run("odometry", images, "--camera", CAMERA, "--mask", self.path("mask.png"), "--out", self.path("odometry.txt"))
        with open(CAMERA) as f, open(self.path("camera.yaml"), "w") as g:
            g.write(f.read() + "mask: mask.png\n")
        said = must_run("run", "--images", images, "--camera", self.path("camera.yaml"), "--out", self.path("out"), "--to", 60).err
        assert LEFT_OUT not in said

    def test_there_is_none(self):
        for clip in ("map_front", "loop", "lost_and_back"):
            folder = os.path.join(harness.SAMPLE, clip)
            if os.path.exists(f"{folder}/video.mp4"):
                done = must_run("odometry", f"{folder}/video.mp4", "--camera", CAMERA, "--out", self.path("odometry.txt"))
                assert LEFT_OUT not in done.err, clip

    def test_bad_masks_are_refused(self):
        films.write(self.path("small.png"), grey((48, 64), 255))
        films.write(self.path("black.png"), grey((480, 640), 0))
        for mask, words in (("small.png", "64x48"), ("black.png", "whole image"), ("missing.png", "is no image")):
            outcome = oaslam("run", "--images", VIDEO, "--camera", CAMERA, "--mask", self.path(mask), "--out", self.path("refused"))
            assert outcome.code != 0 and mask in outcome.err and words in outcome.err, outcome
        assert not os.path.exists(self.path("refused"))
