"""Two maps made apart become one where they show the same place, and do not where they only look alike."""
import json
import os
import subprocess
import unittest

import harness
from harness import oaslam
from sample_boxes import things


class Merge(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.first, cls.second = cls.path("first.map"), cls.path("second.map")
        # Half of the walk each, with 2.7 seconds in common; the second has a unit of its own, a camera of another name, and class names of its own.
        camera, classes = cls.path("camera.yaml"), cls.path("classes.yaml")
        with open(harness.clip("map_front")[3]) as source, open(camera, "w") as f:
            f.write(source.read().replace("desk_sample", "another_day"))
        with open(classes, "w") as f:
            f.write("names:\n" + "".join(f"  {number}: {name}\n" for number, name in {**{t["category_id"]: t["category"] for t in things()}, 100: "statue"}.items()))
        of_second = [camera if option == harness.clip("map_front")[3] else option for option in harness.clip("map_front")]
        cls.made = [oaslam("run", *harness.clip("map_front"), "--to", 230, "--out", cls.path("first"), "--map-out", cls.first),
                    oaslam("run", *of_second, "--classes", classes, "--from", 150, "--out", cls.path("second"), "--map-out", cls.second)]

    def merge(self, first, second, *args):
        out = self.path("merged.map")
        if os.path.exists(out):
            os.remove(out)
        return oaslam("merge", first, second, "--out", out, *args), out

    def exported(self, map_file):
        """The map as JSON."""
        out = self.path("exported.json")
        done = oaslam("export", "--map", map_file, "--format", "json", "--out", out)
        self.assertEqual(done.code, 0, done)
        return harness.read_json(out)

    def trajectory_error(self, map_file):
        out = self.path("exported.txt")
        done = oaslam("export", "--map", map_file, "--format", "tum", "--out", out)
        self.assertEqual(done.code, 0, done)
        matched = harness.pairs(harness.read_tum(out), harness.read_tum(harness.groundtruth("map_front")))
        return harness.rmse(harness.distances(matched, harness.similarity(matched))), len({tuple(truth) for _, truth in matched})

    def test_two_walks_become_one(self):
        for args in ([], ["--relocalization", "points"], ["--relocalization", "objects"]):
            merging, out = self.merge(self.first, self.second, *args)
            self.assertEqual(merging.code, 0, merging)
            self.assertIn("keyframes of the", merging.out)
            error, poses = self.trajectory_error(out)
            self.assertLess(error, 0.01, args)
            self.assertGreater(poses, 440)
        true = [t["category"] for t in things()]
        objects = [o["category"] for o in self.exported(out)["objects"] if o["state"] == "mapped"]
        for category in set(objects):
            self.assertLessEqual(objects.count(category), true.count(category), f"{category}: {objects}")
        around = oaslam("localize", "--map", out, *harness.clip("query_around"), "--to", 60, "--every-frame", "--out", self.path("around"))
        self.assertEqual(around.code, 0, around)
        self.assertGreater(len(harness.read_tum(self.path("around/poses.txt"))), 50)

    def test_the_order_decides_on_the_frame_only(self):
        merging, out = self.merge(self.second, self.first)
        self.assertEqual(merging.code, 0, merging)
        error, _ = self.trajectory_error(out)
        self.assertLess(error, 0.01)

    def test_cameras_and_class_names_of_both_are_kept(self):
        for first, second in ((self.first, self.second), (self.second, self.first)):
            merging, out = self.merge(first, second)
            self.assertEqual(merging.code, 0, merging)
            exported = self.exported(out)
            self.assertEqual({c["name"] for c in exported["cameras"]}, {"desk_sample", "another_day"})
            self.assertEqual({k["camera"] for k in exported["keyframes"]}, {0, 1})
            self.assertEqual(exported["class_names"]["100"], "statue")
            self.assertEqual(exported["class_names"]["0"], "person")

    def test_anchors_of_both_are_kept(self):
        kept = []
        for map_file, name in ((self.first, "flag"), (self.second, "flag")):
            copy = self.path(f"{name}_{len(kept)}.map")
            thing = min(o["id"] for o in self.exported(map_file)["objects"])
            placed = oaslam("anchors", map_file, "--place", f"{name}=flag@object:{thing}", "--out", copy)
            self.assertEqual(placed.code, 0, placed)
            kept.append(copy)
        merging, out = self.merge(*kept)
        self.assertEqual(merging.code, 0, merging)
        listed = oaslam("anchors", out).out
        self.assertIn("flag ", listed)
        self.assertIn("flag (2)", listed)

    def test_a_mirrored_room_is_refused(self):
        # The same things with the same neighbours, but at exchanged sides: nothing lies as it does in the true room.
        mirrored = self.path("mirrored")
        os.makedirs(mirrored, exist_ok=True)
        source = harness.clip("map_front")
        video = os.path.join(mirrored, "video.mp4")
        subprocess.run(["ffmpeg", "-v", "error", "-i", source[1], "-vf", "hflip", "-frames:v", "200", "-qp", "12", video], check=True)
        entries = harness.read_json(source[5])[:200]
        for entry in entries:
            for d in entry["detections"]:
                x1, y1, x2, y2 = d["bbox"]
                d["bbox"] = [640 - x2, y1, 640 - x1, y2]
                d.pop("ellipse", None)
        boxes = os.path.join(mirrored, "detections.json")
        with open(boxes, "w") as f:
            json.dump(entries, f)
        other = self.path("mirrored.map")
        run = oaslam("run", "--images", video, "--camera", source[3], "--detections", boxes, "--out", mirrored, "--map-out", other)
        self.assertEqual(run.code, 0, run)
        merging, out = self.merge(self.first, other)
        self.assertEqual(merging.code, 1, merging)
        self.assertIn("are not merged", merging.err)
        self.assertIn("keyframes", merging.err)
        self.assertFalse(os.path.exists(out))

    def test_bad_input(self):
        for first, second, args, words in [(self.path("none.map"), self.second, [], "none.map"),
                                           (self.first, self.path("none.map"), [], "none.map"),
                                           (self.first, self.second, ["--relocalization", "luck"], "--relocalization"),
                                           (self.first, self.second, ["--set", "runner.lag=-1"], "runner.lag")]:
            merging, out = self.merge(first, second, *args)
            self.assertNotEqual(merging.code, 0, merging)
            self.assertIn(words, merging.err + merging.out)
            self.assertFalse(os.path.exists(out))
        into_folder = oaslam("merge", self.first, self.second, "--out", self.folder)
        self.assertEqual(into_folder.code, 1, into_folder)
        self.assertIn(self.folder, into_folder.err)


if __name__ == "__main__":
    unittest.main()
