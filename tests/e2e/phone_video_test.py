"""A video as a phone writes it: HEVC with ten bits, a variable rate, stored in the sensor's orientation and marked to be rotated."""
import os
import shutil
import subprocess

import harness
import pytest
from harness import must_run

COUNT = 240  # images of the clip, of which some are left out
KEPT = [i for i in range(COUNT) if i % 4 != 3 and i % 7 != 5]


def encoders():
    if not shutil.which("ffmpeg"):
        return ""
    return subprocess.run(["ffmpeg", "-hide_banner", "-encoders"], capture_output=True, text=True).stdout


def mark_turned(path):
    """Writes into the track header of an MP4 file that it must be rotated clockwise by 90 degrees."""
    content = bytearray(harness.read_bytes(path))
    matrix = content.index(b"tkhd") + 4 + 40
    for place, value in enumerate((0, 0x10000, 0, -0x10000, 0)):
        content[matrix + 4 * place : matrix + 4 * place + 4] = value.to_bytes(4, "big", signed=True)
    with open(path, "wb") as f:
        f.write(content)


@pytest.mark.skipif("libx265" not in encoders(), reason="needs the program ffmpeg with the encoder libx265")
class TestPhoneVideo:
    def test_is_tracked_at_its_own_times(self, tmp_path):
        _, whole, _, camera, *_ = harness.clip("map_front")
        video, out = os.path.join(tmp_path, "phone.mp4"), os.path.join(tmp_path, "out")
        keep = rf"select='lt(n\,{COUNT})*not(eq(mod(n\,4)\,3))*not(eq(mod(n\,7)\,5))',transpose=2"
        subprocess.run(["ffmpeg", "-nostdin", "-loglevel", "error", "-i", whole, "-vf", keep, "-fps_mode", "passthrough", "-c:v", "libx265",
                        "-x265-params", "log-level=none", "-preset", "ultrafast", "-crf", "20", "-pix_fmt", "yuv420p10le", "-tag:v", "hvc1", video],
                       check=True)
        mark_turned(video)
        outcome = must_run("run", "--images", video, "--camera", camera, "--out", out)
        frames = harness.read_csv(os.path.join(out, "frames.csv"))
        assert len(frames) == len(KEPT), outcome
        for row, index in zip(frames, KEPT):
            assert float(row["timestamp"]) == pytest.approx(index / 30, abs=1e-3)
        poses = harness.pairs(harness.read_tum(os.path.join(out, "trajectory.txt")), harness.read_tum(harness.groundtruth("map_front")))
        assert len(poses) > 0.9 * len(KEPT), outcome
        assert harness.rmse(harness.distances(poses, harness.similarity(poses))) < 0.02
