"""Runs without a calibration: the camera is estimated from the images."""
import os
import re
import subprocess
import unittest

import harness
from harness import oaslam

TRUE_FOCAL = 525.0


def without_camera(name):
    """Options that name a clip of the sample, but not its camera."""
    folder = os.path.join(harness.SAMPLE, name)
    return ["--images", f"{folder}/video.mp4", "--detections", f"{folder}/detections.json"]


class AutoCamera(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.out, cls.map = os.path.join(cls.folder, "run"), os.path.join(cls.folder, "desk.map")
        cls.slam = oaslam("run", *without_camera("map_front"), "--out", cls.out, "--map-out", cls.map, "--groundtruth", harness.groundtruth("map_front"))
        cls.made = [cls.slam]

    def focal_of(self, folder):
        with open(os.path.join(folder, "camera.yaml")) as f:
            text = f.read()
        return float(re.search(r"camera_matrix:.*?data: \[([-+.\de]+),", text, re.S).group(1))

    def test_the_focal_length_is_found(self):
        self.assertAlmostEqual(self.focal_of(self.out) / TRUE_FOCAL, 1, delta=0.015)
        summary = harness.read_json(os.path.join(self.out, "summary.json"))
        self.assertEqual(summary["camera"]["source"], "images")
        self.assertAlmostEqual(summary["camera"]["fx"], self.focal_of(self.out), delta=1e-3)
        self.assertLess(summary["camera"]["sigma_f"], 0.01 * TRUE_FOCAL)
        self.assertLess(summary["ate"], 0.005)
        self.assertIn("focal length", self.slam.err + self.slam.out)

    def test_what_is_written_is_read_again(self):
        out = os.path.join(self.folder, "again")
        clip = without_camera("map_front") + ["--to", "60"]
        self.assertEqual(oaslam("run", *clip, "--camera", os.path.join(self.out, "camera.yaml"), "--out", out).code, 0)
        self.assertAlmostEqual(self.focal_of(out), self.focal_of(self.out), delta=1e-3)
        self.assertEqual(harness.read_json(os.path.join(out, "summary.json"))["camera"]["source"], "given")

    def test_the_same_each_time(self):
        folders = [os.path.join(self.folder, name) for name in ("one", "two")]
        for folder in folders:
            outcome = oaslam("run", *without_camera("map_front"), "--to", "200", "--refine-camera", "--camera", "fov:75", "--out", folder)
            self.assertEqual(outcome.code, 0, outcome)
        for name in ("camera.yaml", "trajectory.txt", "keyframes.txt", "objects.json"):
            self.assertEqual(*(harness.read_bytes(os.path.join(folder, name)) for folder in folders), name)
        self.assertAlmostEqual(self.focal_of(folders[0]) / TRUE_FOCAL, 1, delta=0.03)

    def test_a_camera_that_stands_still_is_not_guessed_in_silence(self):
        folder = os.path.join(self.folder, "still")
        subprocess.run([harness.EXTRACT, os.path.join(harness.SAMPLE, "map_front", "video.mp4"), folder, "0", "1"], check=True)
        name = os.listdir(os.path.join(folder, "rgb"))[0]
        listed = os.path.join(self.folder, "still.txt")
        with open(listed, "w") as f:
            f.writelines(f"{i / 30:.6f} still/rgb/{name}\n" for i in range(40))
        outcome = oaslam("run", "--images", listed, "--out", os.path.join(self.folder, "nowhere"))
        self.assertEqual(outcome.code, 0, outcome)
        self.assertIn("not determined by the images", outcome.out + outcome.err)

    def test_single_images_are_localized(self):
        out = os.path.join(self.folder, "query")
        outcome = oaslam("localize", "--map", self.map, *without_camera("query_around"), "--to", "60", "--every-frame", "--out", out)
        self.assertEqual(outcome.code, 0, outcome)
        frames = [f for f in harness.read_csv(os.path.join(out, "frames.csv")) if f["status"] != "failed"]
        self.assertGreater(len(frames), 40)
        for frame in frames:
            self.assertAlmostEqual(float(frame["focal_length"]) / TRUE_FOCAL, 1, delta=0.1)

    def test_detections_alone_need_a_calibration(self):
        detections = os.path.join(harness.SAMPLE, "query_around", "detections.json")
        outcome = oaslam("localize", "--map", self.map, "--detections", detections, "--relocalization", "objects", "--out", os.path.join(self.folder, "boxes"))
        self.assertNotEqual(outcome.code, 0)
        self.assertIn("--camera auto needs --images", outcome.out + outcome.err)


if __name__ == "__main__":
    unittest.main(verbosity=2)
