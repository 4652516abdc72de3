"""SLAM on the sample: its files, the map, the same bytes on a second run."""
import math
import os
import subprocess
import xml.etree.ElementTree

import harness
import numpy as np
import pytest
from harness import must_run, oaslam

FILES = ["trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.json", "frames.csv", "summary.json", "map.svg"]
FRAME_COLUMNS = ("frame,timestamp,state,keypoints,matched,inliers,detections,objects,"
                 "ms_total,ms_features,ms_track,ms_objects,cpu_ms,filled,depth,submap,confidence,sigma_position,sigma_rotation_deg,uncertain").split(",")
STATES = {"initializing", "preliminary", "tracking", "odometry", "relocalized", "objects", "lost"}
SUMMARY_KEYS = set("version seed mode frames tracked keyframes landmarks objects unit loops ms_median ms_mean ms_p95 cpu_s wall_s "
                   "peak_rss_mb mean_iou ate uncertain".split())


def check_objects(path, sim):
    """Most true objects were found near their places, and few others; `sim` maps the map to the sample's world."""
    truth = harness.read_json(os.path.join(harness.SAMPLE, "map_front", "objects_gt.json"))["objects"]
    found = harness.read_json(path)
    centres = [(o["category_id"], harness.apply(sim, o["center"])) for o in found]
    hits = 0
    for o in truth:
        near = 0.75 * max(o["ellipsoid"]["semi_axes"])
        hits += any(category == o["category_id"] and math.dist(c, o["ellipsoid"]["center"]) < near for category, c in centres)
    assert hits >= 0.6 * len(truth)
    assert len(found) < 1.5 * len(truth)
    for o in found:
        assert all(h > 0 for h in o["half_axes"]), o
        assert math.hypot(*o["rotation"]) == pytest.approx(1, abs=5e-5)


class TestSample(harness.InFolder):
    def result(self, name):
        return os.path.join(harness.DESK, name)

    def test_every_file_is_there(self):
        for name in FILES:
            assert os.path.getsize(self.result(name)) > 0, name
        xml.etree.ElementTree.parse(self.result("map.svg"))

    def test_frames(self):
        frames = harness.read_csv(self.result("frames.csv"))
        assert sorted(frames[0]) == sorted(FRAME_COLUMNS)
        assert [int(f["frame"]) for f in frames] == list(range(450))
        assert {f["state"] for f in frames} <= STATES
        for f in frames:
            assert float(f["timestamp"]) == pytest.approx(int(f["frame"]) / 30, abs=5e-5)
            assert float(f["ms_total"]) > 0
        # At a table that stays in view, only what comes before the map is uncertain.
        assert all((f["uncertain"] == "1") == (f["state"] == "preliminary") for f in frames)
        tracked = [f for f in frames if f["state"] == "tracking"]
        assert len(tracked) > 0.9 * 450
        assert min(int(f["inliers"]) for f in tracked if f["inliers"]) > 10
        assert sum(int(f["objects"]) for f in frames[300:]) / 150 > 3

    def test_trajectory_against_ground_truth(self):
        final = harness.read_tum(self.result("trajectory.txt"))
        assert len(final) > 0.9 * 450
        for name, bound in (("trajectory.txt", 0.015), ("keyframes.txt", 0.01), ("trajectory_live.txt", 0.06)):
            assert harness.ate(self.result(name), "map_front") < bound, name
        for _, position, q in final:
            assert all(math.isfinite(v) for v in position)
            assert math.hypot(*q) == pytest.approx(1, abs=5e-6)

    def test_summary(self):
        summary = harness.read_json(self.result("summary.json"))
        assert SUMMARY_KEYS <= set(summary)
        assert summary["frames"] == 450
        assert summary["tracked"] == len(harness.read_tum(self.result("trajectory.txt")))
        assert summary["keyframes"] == len(harness.read_tum(self.result("keyframes.txt")))
        assert summary["objects"] == len(harness.read_json(self.result("objects.json")))
        assert summary["landmarks"] > 500
        assert summary["loose"] == []
        assert summary["mean_iou"] > 0.6
        assert summary["ate"] < 0.015

    def test_objects_are_where_they_are(self):
        check_objects(self.result("objects.json"), harness.map_alignment())

    def test_the_map_can_be_read_back(self):
        info = must_run("info", harness.DESK_MAP)
        assert str(harness.read_json(self.result("summary.json"))["landmarks"]) in info.out.replace(",", "")

    def test_evaluate(self):
        plot = os.path.join(self.folder, "trajectory.svg")
        outcome = must_run("evaluate", "trajectory", self.result("trajectory.txt"), harness.groundtruth("map_front"), "--plot", plot)
        assert "ATE" in outcome.out.upper()
        xml.etree.ElementTree.parse(plot)


class TestMetricScale:
    @pytest.fixture(autouse=True)
    def each_in_a_folder(self, tmp_path):
        self.folder = str(tmp_path)

    def map_scale(self, *options, code=0, message=""):
        """The scale of the map made with the options, in metres of the sample's world per map unit; 1 if it is right."""
        saved = os.path.join(self.folder, "m.map")
        outcome = oaslam("run", *harness.clip("map_front"), "--out", self.folder, "--map-out", saved, *options)
        assert outcome.code == code, outcome
        assert message in outcome.err
        truth = harness.read_tum(harness.groundtruth("map_front"))
        scales = [harness.similarity(harness.pairs(harness.read_tum(os.path.join(self.folder, name)), truth))[0]
                  for name in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt")]
        assert scales == pytest.approx(3 * [scales[0]], rel=0.02)
        unit = "metre" if code == 0 else "arbitrary"
        assert harness.read_json(os.path.join(self.folder, "summary.json"))["unit"] == unit
        assert unit in oaslam("info", saved).out
        self.said = outcome
        return scales[0]

    def by_objects(self):
        return harness.read_json(os.path.join(self.folder, "summary.json")).get("unit_by_objects")

    def test_by_the_usual_sizes_of_objects_without_being_asked(self):
        scale = self.map_scale()
        by_objects = self.by_objects()
        assert by_objects["classes"] >= 3 and by_objects["objects"] >= by_objects["classes"]
        assert abs(math.log(scale)) < 2.5 * by_objects["sigma"] < 0.3
        line = f"metres, 1.00 +- {by_objects['sigma']:.2f} (by {by_objects['objects']} objects)"
        assert f"unit: {line}" in self.said.out
        saved = os.path.join(self.folder, "m.map")
        assert line in oaslam("info", saved).out
        # More is seen, and the unit estimated again; in the same world.
        again = must_run("run", *harness.clip("map_front"), "--map-in", saved, "--from", "200", "--out", self.folder, "--map-out", saved)
        assert "unit: metres, 1.00 +- " in again.out
        truth = harness.read_tum(harness.groundtruth("map_front"))
        scale = harness.similarity(harness.pairs(harness.read_tum(os.path.join(self.folder, "trajectory.txt")), truth))[0]
        assert abs(math.log(scale)) < 2.5 * self.by_objects()["sigma"]

    def test_a_length_that_the_objects_contradict_is_said(self):
        self.map_scale("--scale-object", "cup=0.04")
        assert "--scale-object cup=0.04: by the usual sizes of" in self.said.err
        assert self.by_objects() is None

    def test_none(self):
        must_run("run", *harness.clip("map_front"), "--to", "250", "--out", self.folder, "--scale", "none")
        assert harness.read_json(os.path.join(self.folder, "summary.json"))["unit"] == "arbitrary"

    def test_from_an_object(self):
        truth = harness.read_json(os.path.join(harness.SAMPLE, "map_front", "objects_gt.json"))["objects"]
        height = sorted(2 * o["half_extents"][2] for o in truth if o["category"] == "teddy bear")[0]
        assert self.map_scale("--scale-object", f"teddy bear={height}") == pytest.approx(1, abs=0.15)

    def test_from_a_distance(self):
        positions = {round(t, 3): p for t, p, _ in harness.read_tum(harness.groundtruth("map_front"))}
        metres = math.dist(positions[3.0], positions[12.0])
        assert self.map_scale("--scale-from", f"3.0:12.0={metres}") == pytest.approx(1, abs=0.02)

    def test_from_ground_truth(self):
        assert self.map_scale("--scale-from", "gt", "--groundtruth", harness.groundtruth("map_front")) == pytest.approx(1, abs=0.01)

    def test_without_such_an_object_results_are_saved_in_their_unit(self):
        self.map_scale("--scale-object", "giraffe=4.5", code=1, message="no object of this class")

    def test_bad_settings_are_refused_at_once(self):
        for options, words in ((("--scale-object", "cupp=0.1"), '"cup"'), (("--scale-object", "cup"), "CLASS=HEIGHT_M"),
                               (("--scale-object", "cup=tall"), "not a number"), (("--scale-object", "cup=0"), "0.001 to 10000"),
                               (("--scale-from", "gt"), "--groundtruth"), (("--scale-from", "3=1"), "T1:T2=METRES"),
                               (("--scale", "half"), "{auto,none}"), (("--scale", "auto", "--scale-object", "cup=0.1"), "--scale excludes --scale-object")):
            outcome = oaslam("run", *harness.clip("map_front"), "--out", os.path.join(self.folder, "out"), *options)
            assert outcome.code != 0, options
            assert words in outcome.err


class TestMapObjects:
    def test_objects_from_known_poses(self, tmp_path):
        must_run("map-objects", "--trajectory", harness.groundtruth("map_front"), *harness.clip("map_front")[2:], "--out", tmp_path)
        # The frame and the scale of the trajectory stay: no alignment.
        check_objects(os.path.join(tmp_path, "objects.json"), (1, np.eye(3), [0, 0, 0]))
        assert harness.read_json(os.path.join(tmp_path, "summary.json"))["mean_iou"] > 0.7


class TestLostAndBack:
    """The camera swings down to the floor and comes up 87 degrees further round, where no landmark of the map is visible: a new map is made, and placed by objects."""

    def run_clip(self, out, *options):
        must_run("run", *harness.clip("lost_and_back"), "--out", out, "--map-out", out + ".map", *options)
        return harness.read_tum(os.path.join(out, "trajectory.txt"))

    def test_it_goes_on_mapping_where_points_alone_are_lost(self, tmp_path):
        out = os.path.join(tmp_path, "first")
        final = self.run_clip(out)
        assert len(final) > 0.75 * 350
        assert harness.ate(os.path.join(out, "trajectory.txt"), "lost_and_back") < 0.015
        frames = harness.read_csv(os.path.join(out, "frames.csv"))
        assert "relocalized" in {f["state"] for f in frames}
        assert frames[-1]["state"] == "tracking"
        # While the new map is not placed yet, objects give a pose at once.
        assert sum(f["state"] == "objects" for f in frames) > 20
        assert len(harness.read_tum(os.path.join(out, "trajectory_live.txt"))) > 0.84 * 350
        check_objects(os.path.join(out, "objects.json"), harness.map_alignment(out, "lost_and_back"))
        assert oaslam("info", out + ".map").code == 0
        again = os.path.join(tmp_path, "again")
        self.run_clip(again)
        for name in ("first.map", "first/trajectory.txt", "first/trajectory_live.txt", "first/objects.json"):
            assert harness.read_bytes(os.path.join(tmp_path, name)) == harness.read_bytes(os.path.join(tmp_path, name.replace("first", "again"))), name

    def test_by_points_alone_it_stays_lost(self, tmp_path):
        assert len(self.run_clip(os.path.join(tmp_path, "out"), "--relocalization", "points")) < 0.6 * 350


class TestCoveredAndBack:
    """The lens is covered; then the camera goes all the way round before it sees the mapped part again."""

    def test_what_was_mapped_meanwhile_is_kept(self, tmp_path):
        loop = os.path.join(harness.SAMPLE, "loop")
        subprocess.run([harness.EXTRACT, os.path.join(loop, "video.mp4"), tmp_path, "0", "700"], check=True)
        listed = os.path.join(tmp_path, "rgb.txt")
        with open(listed) as f:
            names = [line.split()[1] for line in f]
        for i in range(100, 180):
            with open(os.path.join(tmp_path, names[i]), "wb") as f:
                f.write(b"P5 640 480 255\n" + bytes(640 * 480))
        out = os.path.join(tmp_path, "out")
        outcome = must_run("run", "--images", listed, "--camera", os.path.join(loop, "camera.yaml"), "--relocalization", "points", "--out", out)
        assert "was joined" in outcome.err
        trajectory = os.path.join(out, "trajectory.txt")
        assert len(harness.read_tum(trajectory)) > 0.95 * (700 - 80)
        assert harness.ate(trajectory, "loop") < 0.03
