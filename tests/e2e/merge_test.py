"""Two maps made apart become one where they show the same place, and do not where they only look alike."""
import json
import os
import subprocess

import harness
from harness import must_run, oaslam
from map_reader import MapFile
from sample_boxes import things


class TestMerge(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.first, cls.second = cls.path("first.map"), cls.path("second.map")
        # Half of the walk each, with 2.7 seconds in common; the second has a unit of its own, a camera of another name, and class names of its own.
        camera, classes = cls.path("camera.yaml"), cls.path("classes.yaml")
        with open(harness.clip("map_front")[3]) as source, open(camera, "w") as f:
            f.write(source.read().replace("desk_sample", "another_day"))
        with open(classes, "w") as f:
            f.write("names:\n" + "".join(f"  {number}: {name}\n" for number, name in {**{t["category_id"]: t["category"] for t in things()}, 100: "statue"}.items()))
        of_second = [camera if option == harness.clip("map_front")[3] else option for option in harness.clip("map_front")]
        must_run("run", *harness.clip("map_front"), "--to", 230, "--out", cls.path("first"), "--map-out", cls.first)
        must_run("run", *of_second, "--classes", classes, "--from", 150, "--out", cls.path("second"), "--map-out", cls.second)

    def merge(self, first, second, *args):
        out = self.path("merged.map")
        if os.path.exists(out):
            os.remove(out)
        return oaslam("merge", first, second, "--out", out, *args), out

    def trajectory_error(self, map_file):
        out = self.path("exported")
        must_run("export", "--map", map_file, "--format", "tum", "--out", out)  # a file for each of the two recordings
        poses = [pose for name in sorted(os.listdir(out)) for pose in harness.read_tum(os.path.join(out, name))]
        matched = harness.pairs(poses, harness.read_tum(harness.groundtruth("map_front")))
        return harness.rmse(harness.distances(matched, harness.similarity(matched))), len({tuple(truth) for _, truth in matched})

    def test_two_walks_become_one(self):
        for args in ([], ["--relocalization", "points"], ["--relocalization", "objects"]):
            merging, out = self.merge(self.first, self.second, *args)
            assert merging.code == 0, merging
            assert "keyframes of the" in merging.out
            error, poses = self.trajectory_error(out)
            assert error < 0.01, args
            assert poses > 440
        true = [t["category"] for t in things()]
        objects = [o["label"] for o in MapFile(out).objects.values()]
        for category in set(objects):
            assert objects.count(category) <= true.count(category), f"{category}: {objects}"
        must_run("localize", "--map", out, *harness.clip("query_around"), "--to", 60, "--every-frame", "--out", self.path("around"))
        assert len(harness.read_tum(self.path("around/poses.txt"))) > 50

    def test_the_order_decides_on_the_frame_only(self):
        merging, out = self.merge(self.second, self.first)
        assert merging.code == 0, merging
        error, _ = self.trajectory_error(out)
        assert error < 0.01

    def test_cameras_and_class_names_of_both_are_kept(self):
        for first, second in ((self.first, self.second), (self.second, self.first)):
            merging, out = self.merge(first, second)
            assert merging.code == 0, merging
            merged = MapFile(out)
            assert {c["name"] for c in merged.cameras.values()} == {"desk_sample", "another_day"}
            assert {k["camera"] for k in merged.keyframes.values()} == {0, 1}
            assert merged.names[100] == "statue"
            assert merged.names[0] == "person"

    def test_anchors_of_both_are_kept(self):
        kept = []
        for map_file, name in ((self.first, "flag"), (self.second, "flag")):
            copy = self.path(f"{name}_{len(kept)}.map")
            thing = min(MapFile(map_file).objects)
            must_run("anchors", map_file, "--place", f"{name}=flag@object:{thing}", "--out", copy)
            kept.append(copy)
        merging, out = self.merge(*kept)
        assert merging.code == 0, merging
        listed = oaslam("anchors", out).out
        assert "flag " in listed
        assert "flag (2)" in listed

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
        must_run("run", "--images", video, "--camera", source[3], "--detections", boxes, "--out", mirrored, "--map-out", other)
        merging, out = self.merge(self.first, other)
        assert merging.code == 1, merging
        assert "are not merged" in merging.err
        assert "keyframes" in merging.err
        assert not os.path.exists(out)

    def test_bad_input(self):
        for first, second, args, words in [(self.path("none.map"), self.second, [], "none.map"),
                                           (self.first, self.path("none.map"), [], "none.map"),
                                           (self.first, self.second, ["--relocalization", "luck"], "--relocalization"),
                                           (self.first, self.second, ["--set", "runner.lag=-1"], "runner.lag")]:
            merging, out = self.merge(first, second, *args)
            assert merging.code != 0, merging
            assert words in merging.err + merging.out
            assert not os.path.exists(out)
        into_folder = oaslam("merge", self.first, self.second, "--out", self.folder)
        assert into_folder.code == 1, into_folder
        assert self.folder in into_folder.err
