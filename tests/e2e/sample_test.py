"""SLAM on the sample: its files, the map, the same bytes on a second run."""
import math
import os
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

import harness
from harness import oaslam

FILES = ["trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.json", "frames.csv", "summary.json", "map.svg"]
FRAME_COLUMNS = ("frame,timestamp,state,keypoints,matched,inliers,detections,objects,"
                 "ms_total,ms_features,ms_track,ms_objects,cpu_ms,filled,depth,piece").split(",")
STATES = {"initializing", "tracking", "relocalized", "objects", "lost"}
SUMMARY_KEYS = set("version seed mode frames tracked keyframes landmarks objects unit loops ms_median ms_mean ms_p95 cpu_s wall_s "
                   "peak_rss_mb mean_iou ate".split())


def check_objects(test, path, sim):
    """Most true objects were found near their places, and few others; `sim` maps the map to the sample's world."""
    truth = harness.read_json(os.path.join(harness.SAMPLE, "map_front", "objects_gt.json"))["objects"]
    found = harness.read_json(path)
    centres = [(o["category_id"], harness.apply(sim, o["center"])) for o in found]
    hits = 0
    for o in truth:
        near = 0.75 * max(o["ellipsoid"]["semi_axes"])
        hits += any(category == o["category_id"] and math.dist(c, o["ellipsoid"]["center"]) < near for category, c in centres)
    test.assertGreaterEqual(hits, 0.6 * len(truth))
    test.assertLess(len(found), 1.5 * len(truth))
    for o in found:
        test.assertTrue(all(h > 0 for h in o["half_axes"]), o)
        test.assertAlmostEqual(math.hypot(*o["rotation"]), 1, places=4)


class Sample(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_folder, cls.map = os.path.join(cls.folder, "map"), os.path.join(cls.folder, "desk.map")
        cls.made = [oaslam("run", *harness.clip("map_front"), "--groundtruth", harness.groundtruth("map_front"),
                           "--out", cls.run_folder, "--map-out", cls.map)]

    def result(self, name):
        return os.path.join(self.run_folder, name)

    def test_every_file_is_there(self):
        for name in FILES:
            self.assertGreater(os.path.getsize(self.result(name)), 0, name)
        xml.etree.ElementTree.parse(self.result("map.svg"))

    def test_frames(self):
        frames = harness.read_csv(self.result("frames.csv"))
        self.assertEqual(sorted(frames[0]), sorted(FRAME_COLUMNS))
        self.assertEqual([int(f["frame"]) for f in frames], list(range(450)))
        self.assertLessEqual({f["state"] for f in frames}, STATES)
        for f in frames:
            self.assertAlmostEqual(float(f["timestamp"]), int(f["frame"]) / 30, places=4)
            self.assertGreater(float(f["ms_total"]), 0)
        tracked = [f for f in frames if f["state"] == "tracking"]
        self.assertGreater(len(tracked), 0.9 * 450)
        self.assertGreater(min(int(f["inliers"]) for f in tracked), 10)
        self.assertGreater(sum(int(f["objects"]) for f in frames[300:]) / 150, 3)

    def test_trajectory_against_ground_truth(self):
        truth = harness.read_tum(harness.groundtruth("map_front"))
        final = harness.read_tum(self.result("trajectory.txt"))
        self.assertGreater(len(final), 0.9 * 450)
        for name, bound in (("trajectory.txt", 0.015), ("keyframes.txt", 0.01), ("trajectory_live.txt", 0.06)):
            matched = harness.pairs(harness.read_tum(self.result(name)), truth)
            self.assertLess(harness.rmse(harness.distances(matched, harness.similarity(matched))), bound, name)
        for _, position, q in final:
            self.assertTrue(all(math.isfinite(v) for v in position))
            self.assertAlmostEqual(math.hypot(*q), 1, places=5)

    def test_summary(self):
        summary = harness.read_json(self.result("summary.json"))
        self.assertLessEqual(SUMMARY_KEYS, set(summary))
        self.assertEqual(summary["frames"], 450)
        self.assertEqual(summary["tracked"], len(harness.read_tum(self.result("trajectory.txt"))))
        self.assertEqual(summary["keyframes"], len(harness.read_tum(self.result("keyframes.txt"))))
        self.assertEqual(summary["objects"], len(harness.read_json(self.result("objects.json"))))
        self.assertGreater(summary["landmarks"], 500)
        self.assertGreater(summary["mean_iou"], 0.6)
        self.assertLess(summary["ate"], 0.015)

    def test_objects_are_where_they_are(self):
        check_objects(self, self.result("objects.json"), harness.map_alignment(self.run_folder))

    def test_the_map_can_be_read_back(self):
        info = oaslam("info", self.map)
        self.assertEqual(info.code, 0, info)
        self.assertIn(str(harness.read_json(self.result("summary.json"))["landmarks"]), info.out.replace(",", ""))

    def test_evaluate(self):
        plot = os.path.join(self.folder, "trajectory.svg")
        outcome = oaslam("evaluate", "trajectory", self.result("trajectory.txt"), harness.groundtruth("map_front"), "--plot", plot)
        self.assertEqual(outcome.code, 0, outcome)
        self.assertIn("ATE", outcome.out.upper())
        xml.etree.ElementTree.parse(plot)


class MetricScale(unittest.TestCase):
    def map_scale(self, *options, code=0, message=""):
        """The scale of the map made with the options, in metres of the sample's world per map unit; 1 if it is right."""
        with tempfile.TemporaryDirectory(prefix="oaslam_scale_") as folder:
            outcome = oaslam("run", *harness.clip("map_front"), "--out", folder, "--map-out", os.path.join(folder, "m.map"), *options)
            self.assertEqual(outcome.code, code, outcome)
            self.assertIn(message, outcome.err)
            scales = []
            for name in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt"):
                matched = harness.pairs(harness.read_tum(os.path.join(folder, name)), harness.read_tum(harness.groundtruth("map_front")))
                scales.append(harness.similarity(matched)[0])
            for scale in scales:
                self.assertAlmostEqual(scale / scales[0], 1, delta=0.02)
            unit = "metre" if code == 0 else "arbitrary"
            self.assertEqual(harness.read_json(os.path.join(folder, "summary.json"))["unit"], unit)
            self.assertIn(unit, oaslam("info", os.path.join(folder, "m.map")).out)
            return scales[0]

    def test_from_an_object(self):
        truth = harness.read_json(os.path.join(harness.SAMPLE, "map_front", "objects_gt.json"))["objects"]
        height = sorted(2 * o["half_extents"][2] for o in truth if o["category"] == "teddy bear")[0]
        self.assertAlmostEqual(self.map_scale("--scale-object", f"teddy bear={height}"), 1, delta=0.15)

    def test_from_a_distance(self):
        positions = {round(t, 3): p for t, p, _ in harness.read_tum(harness.groundtruth("map_front"))}
        metres = math.dist(positions[3.0], positions[12.0])
        self.assertAlmostEqual(self.map_scale("--scale-from", f"3.0:12.0={metres}"), 1, delta=0.02)

    def test_from_ground_truth(self):
        self.assertAlmostEqual(self.map_scale("--scale-from", "gt", "--groundtruth", harness.groundtruth("map_front")), 1, delta=0.01)

    def test_without_such_an_object_results_are_saved_in_their_unit(self):
        self.map_scale("--scale-object", "giraffe=4.5", code=1, message="no object of this class")

    def test_bad_settings_are_refused_at_once(self):
        for options, words in ((("--scale-object", "cupp=0.1"), '"cup"'), (("--scale-object", "cup"), "CLASS=HEIGHT_M"),
                               (("--scale-object", "cup=tall"), "not a number"), (("--scale-object", "cup=0"), "0.001 to 10000"),
                               (("--scale-from", "gt"), "--groundtruth"), (("--scale-from", "3=1"), "T1:T2=METRES")):
            with tempfile.TemporaryDirectory(prefix="oaslam_scale_") as folder:
                outcome = oaslam("run", *harness.clip("map_front"), "--out", os.path.join(folder, "out"), *options)
                self.assertNotEqual(outcome.code, 0, options)
                self.assertIn(words, outcome.err)


class MapObjects(unittest.TestCase):
    def test_objects_from_known_poses(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_objects_") as folder:
            outcome = oaslam("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:], "--out", folder)
            self.assertEqual(outcome.code, 0, outcome)
            # The frame and the scale of the trajectory stay: no alignment.
            check_objects(self, os.path.join(folder, "objects.json"), (1, [0, 0, 0, 1], [0, 0, 0]))
            self.assertGreater(harness.read_json(os.path.join(folder, "summary.json"))["mean_iou"], 0.7)


class LostAndBack(unittest.TestCase):
    """The camera swings down to the floor and comes up 87 degrees further round, where no landmark of the map is visible: a new map is made, and placed by objects."""

    def run_clip(self, out, *options):
        outcome = oaslam("run", *harness.clip("lost_and_back"), "--out", out, "--map-out", out + ".map", *options)
        self.assertEqual(outcome.code, 0, outcome)
        return harness.read_tum(os.path.join(out, "trajectory.txt"))

    def test_it_goes_on_mapping_where_points_alone_are_lost(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_lost_") as folder:
            out = os.path.join(folder, "first")
            final = self.run_clip(out)
            self.assertGreater(len(final), 0.75 * 350)
            matched = harness.pairs(final, harness.read_tum(harness.groundtruth("lost_and_back")))
            self.assertLess(harness.rmse(harness.distances(matched, harness.similarity(matched))), 0.015)
            frames = harness.read_csv(os.path.join(out, "frames.csv"))
            self.assertIn("relocalized", {f["state"] for f in frames})
            self.assertEqual(frames[-1]["state"], "tracking")
            self.assertGreater(sum(int(f["filled"]) for f in frames), 20)
            check_objects(self, os.path.join(out, "objects.json"), harness.map_alignment(out, "lost_and_back"))
            self.assertEqual(oaslam("info", out + ".map").code, 0)
            again = os.path.join(folder, "again")
            self.run_clip(again)
            for name in ("first.map", "first/trajectory.txt", "first/trajectory_live.txt", "first/objects.json"):
                self.assertEqual(harness.read_bytes(os.path.join(folder, name)), harness.read_bytes(os.path.join(folder, name.replace("first", "again"))), name)

    def test_by_points_alone_it_stays_lost(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_lost_") as folder:
            self.assertLess(len(self.run_clip(os.path.join(folder, "out"), "--relocalization", "points")), 0.6 * 350)


class CoveredAndBack(unittest.TestCase):
    """The lens is covered; then the camera goes all the way round before it sees the mapped part again."""

    def test_what_was_mapped_meanwhile_is_kept(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_covered_") as folder:
            loop = os.path.join(harness.SAMPLE, "loop")
            subprocess.run([harness.EXTRACT, os.path.join(loop, "video.mp4"), folder, "0", "700"], check=True)
            listed = os.path.join(folder, "rgb.txt")
            with open(listed) as f:
                names = [line.split()[1] for line in f]
            for i in range(100, 180):
                with open(os.path.join(folder, names[i]), "wb") as f:
                    f.write(b"P5 640 480 255\n" + bytes(640 * 480))
            out = os.path.join(folder, "out")
            outcome = oaslam("run", "--images", listed, "--camera", os.path.join(loop, "camera.yaml"), "--relocalization", "points", "--out", out)
            self.assertEqual(outcome.code, 0, outcome)
            self.assertIn("was joined", outcome.err)
            final = harness.read_tum(os.path.join(out, "trajectory.txt"))
            self.assertGreater(len(final), 0.95 * (700 - 80))
            matched = harness.pairs(final, harness.read_tum(harness.groundtruth("loop")))
            self.assertLess(harness.rmse(harness.distances(matched, harness.similarity(matched))), 0.03)


class Repeat(unittest.TestCase):
    def test_the_same_bytes_twice(self):
        with tempfile.TemporaryDirectory(prefix="oaslam_repeat_") as folder:
            contents = []
            for name in ("first", "second"):
                out = os.path.join(folder, name)
                outcome = oaslam("run", *harness.clip("map_front"), "--to", "150", "--out", out, "--map-out", out + ".map")
                self.assertEqual(outcome.code, 0, outcome)
                files = [os.path.join(out, f) for f in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.json")]
                contents.append({os.path.basename(f): harness.read_bytes(f) for f in files})
                contents[-1]["map"] = harness.read_bytes(out + ".map")
            self.assertGreater(len(contents[0]["trajectory.txt"]), 1000)
            for name, content in contents[0].items():
                self.assertEqual(content, contents[1][name], name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
