"""`oaslam detect` with a real network, and a run that takes its boxes. Needs OASLAM_DATA; skipped (77) without."""
import os
import sys
import tempfile
import unittest

import harness
from harness import oaslam

MODEL = os.path.join(os.environ.get("OASLAM_DATA", ""), "models", "yolox_nano.onnx")
FRAMES = 40


class Detect(unittest.TestCase):
    def test_detections_are_those_that_run_uses(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_detect_") as folder:
            found = os.path.join(folder, "detections.json")
            source = harness.clip("map_front")[:2] + ["--to", FRAMES]
            outcome = oaslam("detect", *source, "--detector", MODEL, "--out", found)
            self.assertEqual(outcome.code, 0, outcome)
            images = harness.read_json(found)
            self.assertEqual([i["file_name"] for i in images], [f"{i:06d}" for i in range(FRAMES)])
            counts = []
            for name, boxes in (("file", ["--detections", found]), ("network", ["--detector", MODEL])):
                out = os.path.join(folder, name)
                outcome = oaslam("run", *source, *harness.clip("map_front")[2:4], *boxes, "--out", out)
                self.assertEqual(outcome.code, 0, outcome)
                counts.append([int(f["detections"]) for f in harness.read_csv(os.path.join(out, "frames.csv"))])
            self.assertGreater(sum(counts[0]), FRAMES)
            self.assertEqual(counts[0], counts[1])
            self.assertEqual(counts[0], [len(i["detections"]) for i in images])


if __name__ == "__main__":
    if not os.path.exists(MODEL):
        print("skipped: needs models/yolox_nano.onnx under OASLAM_DATA")
        sys.exit(77)
    unittest.main(verbosity=2)
