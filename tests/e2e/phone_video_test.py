"""A video as a phone writes it: HEVC with ten bits, a variable rate, stored in the sensor's orientation and marked to be rotated."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import harness
from harness import oaslam

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


class PhoneVideo(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="oaslam_phone_")
        self.addCleanup(shutil.rmtree, self.folder)

    def test_is_tracked_at_its_own_times(self):
        _, whole, _, camera, *_ = harness.clip("map_front")
        video, out = os.path.join(self.folder, "phone.mp4"), os.path.join(self.folder, "out")
        keep = rf"select='lt(n\,{COUNT})*not(eq(mod(n\,4)\,3))*not(eq(mod(n\,7)\,5))',transpose=2"
        subprocess.run(["ffmpeg", "-nostdin", "-loglevel", "error", "-i", whole, "-vf", keep, "-fps_mode", "passthrough", "-c:v", "libx265",
                        "-x265-params", "log-level=none", "-preset", "ultrafast", "-crf", "20", "-pix_fmt", "yuv420p10le", "-tag:v", "hvc1", video],
                       check=True)
        mark_turned(video)
        outcome = oaslam("run", "--images", video, "--camera", camera, "--out", out)
        self.assertEqual(outcome.code, 0, outcome)
        frames = harness.read_csv(os.path.join(out, "frames.csv"))
        self.assertEqual(len(frames), len(KEPT), outcome)
        for row, index in zip(frames, KEPT):
            self.assertAlmostEqual(float(row["timestamp"]), index / 30, delta=1e-3)
        poses = harness.pairs(harness.read_tum(os.path.join(out, "trajectory.txt")), harness.read_tum(harness.groundtruth("map_front")))
        self.assertGreater(len(poses), 0.9 * len(KEPT), outcome)
        self.assertLess(harness.rmse(harness.distances(poses, harness.similarity(poses))), 0.02)


if __name__ == "__main__":
    if "libx265" not in encoders():
        print("SKIPPED: needs the program ffmpeg with the encoder libx265")
        sys.exit(77)
    unittest.main(verbosity=2)
