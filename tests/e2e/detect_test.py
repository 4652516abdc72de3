"""`oaslam detect` with a real network, and a run that uses its boxes:  detect_test.py [onnxruntime|opencv]

The argument is the library that runs the network; the test is skipped (77) where that is not built in.
"""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import harness
from harness import oaslam

BACKEND = sys.argv.pop() if len(sys.argv) > 1 and sys.argv[-1] in ("onnxruntime", "opencv") else "auto"
DETECTOR = ["--detector", harness.MODEL, "--detector-backend", BACKEND]
FRAMES = 40


class Detect(unittest.TestCase):
    def test_detections_are_those_that_run_uses(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_detect_") as folder:
            found = os.path.join(folder, "detections.json")
            source = harness.clip("map_front")[:2] + ["--to", FRAMES]
            outcome = oaslam("detect", *source, *DETECTOR, "--out", found, "--quiet")
            self.assertEqual(outcome.code, 0, outcome)
            self.assertLess(outcome.err.count("\n"), 4, outcome)  # lines of its own, none of the library
            images = harness.read_json(found)
            self.assertEqual([i["file_name"] for i in images], [f"{i:06d}" for i in range(FRAMES)])
            counts = []
            for name, boxes in (("file", ["--detections", found]), ("network", DETECTOR + ["--detect-every", 1])):
                out = os.path.join(folder, name)
                outcome = oaslam("run", *source, *harness.clip("map_front")[2:4], *boxes, "--out", out)
                self.assertEqual(outcome.code, 0, outcome)
                counts.append([int(f["detections"]) for f in harness.read_csv(os.path.join(out, "frames.csv"))])
            self.assertGreater(sum(counts[0]), FRAMES)
            self.assertEqual(counts[0], counts[1])
            self.assertEqual(counts[0], [len(i["detections"]) for i in images])

    def test_goes_on_where_it_was_interrupted(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_detect_") as folder:
            whole, parts = os.path.join(folder, "whole.json"), os.path.join(folder, "parts.json")
            source = harness.clip("map_front")[:2]
            for out, options in ((whole, ["--to", 12]), (parts, ["--to", 5]), (parts, ["--to", 12, "--resume"])):
                outcome = oaslam("detect", *source, *DETECTOR, "--out", out, *options)
                self.assertEqual(outcome.code, 0, outcome)
            self.assertIn("5 images are done", outcome.err)
            self.assertEqual(harness.read_bytes(whole), harness.read_bytes(parts))
            with open(parts, "w") as f:
                f.write("[{")
            outcome = oaslam("detect", *source, *DETECTOR, "--out", parts, "--resume")
            self.assertEqual(outcome.code, 1, outcome)
            self.assertIn("parts.json", outcome.err)

    def test_interrupted_before_the_first_image(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_detect_") as folder:
            images, out = os.path.join(folder, "images"), os.path.join(folder, "found.json")
            os.mkdir(images)
            command = [harness.BINARY, "detect", "--images", images, "--follow", *DETECTOR, "--out", out]
            process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
            process.stderr.readline()  # the layout of the network: all is set up
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=30)
            self.assertEqual(process.returncode, 130, err)
            self.assertNotIn("error", err)
            self.assertFalse(os.path.exists(out))

    def test_a_kill_does_not_lose_all(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_detect_") as folder:
            out = os.path.join(folder, "found.json")
            process = subprocess.Popen([harness.BINARY, "detect", *harness.clip("map_front")[:2], *DETECTOR, "--out", out, "--quiet"])
            deadline = time.time() + 300
            while process.poll() is None and not os.path.exists(out) and time.time() < deadline:
                time.sleep(0.02)
            process.kill()
            process.wait()
            self.assertEqual(process.returncode, -signal.SIGKILL)
            self.assertEqual([i["file_name"] for i in harness.read_json(out)], [f"{i:06d}" for i in range(200)])

    def test_live_nobody_waits_for_the_detector(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_detect_") as folder:
            source = harness.clip("map_front")[:4]
            outcome = oaslam("run", *source, *DETECTOR, "--mode", "live", "--to", 150, "--out", folder)
            self.assertEqual(outcome.code, 0, outcome)
            summary = harness.read_json(os.path.join(folder, "summary.json"))
            frames = harness.read_csv(os.path.join(folder, "frames.csv"))
            detector = summary["detector"]
            self.assertTrue(0 < detector["images"] <= len(frames), (detector, len(frames)))  # at its own pace
            self.assertGreater(detector["rate_hz"], 0)
            seen = sum(int(f["detections"]) > 0 for f in frames)
            self.assertTrue(0 < seen <= detector["images"], (seen, detector))


if __name__ == "__main__":
    if BACKEND == "onnxruntime" and "ONNX Runtime" not in oaslam("--version").out:
        print("skipped: ONNX Runtime is not built in")
        sys.exit(77)
    if not os.path.exists(harness.MODEL):
        print("skipped: needs models/yolox_nano.onnx under OASLAM_DATA")
        sys.exit(77)
    unittest.main(verbosity=2)
