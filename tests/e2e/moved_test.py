"""A cup of the sample is moved, or taken away, between the making of a map and its use. Its boxes are derived from its true ellipsoid."""
import json
import math
import os
import random

import harness
from harness import must_run
from sample_boxes import detect, iou, project, things

CUP = "cup_8"
SHIFT = (0.02, -0.25, 0.0)  # metres: nearer to the camera


class TestMoved(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.to_world = harness.map_alignment()
        cls.moved, cls.gone = cls.detections("moved.json", True), cls.detections("gone.json", False)

    def setup_method(self):
        self.before = harness.read_json(os.path.join(harness.DESK, "objects.json"))
        self.cup = min(self.before, key=lambda o: self.off(o, (0, 0, 0)) if o["category"] == "cup" else 9)
        assert self.off(self.cup, (0, 0, 0)) < 0.05

    @classmethod
    def detections(cls, name, is_there):
        rng = random.Random(3)
        cup = next(t for t in things() if t["name"] == CUP)["ellipsoid"]
        entries = harness.read_json(harness.clip("map_front")[-1])
        for entry, (_, position, quaternion) in zip(entries, harness.read_tum(harness.groundtruth("map_front")), strict=True):
            old = project(cup["center"], cup["semi_axes"], cup["rotation"], position, quaternion)
            entry["detections"] = [d for d in entry["detections"] if d["category_id"] != 41 or not old or iou(d["bbox"], old) < 0.3]
            center = [c + s for c, s in zip(cup["center"], SHIFT)]
            new = detect(41, project(center, cup["semi_axes"], cup["rotation"], position, quaternion), rng, 0.6)
            entry["detections"] += [new] if new and is_there else []
        path = os.path.join(cls.folder, name)
        with open(path, "w") as f:
            json.dump(entries, f)
        return path

    def off(self, an_object, shift):
        """The distance in metres of an object from the cup's true place, moved by `shift`."""
        truth = next(t for t in things() if t["name"] == CUP)["ellipsoid"]["center"]
        return math.dist(harness.apply(self.to_world, an_object["center"]), [c + s for c, s in zip(truth, shift)])

    def go_on(self, detections):
        out = os.path.join(self.folder, "again")
        outcome = must_run("run", *harness.clip("map_front")[:-1], detections, "--map-in", harness.DESK_MAP, "--out", out)
        return outcome, harness.read_json(os.path.join(out, "objects.json"))

    def others(self, objects):
        return {o["id"] for o in objects} - {self.cup["id"]}

    def test_a_moved_object_moves_in_the_map(self):
        outcome, after = self.go_on(self.moved)
        cup = next(o for o in after if o["id"] == self.cup["id"])
        assert cup["moved"]
        assert self.off(cup, SHIFT) < 0.04
        assert sum("moved" in o for o in after) == 1
        assert sum(f"object {cup['id']} (class 41) has moved" in line for line in outcome.err.splitlines()) == 1, outcome
        assert self.others(after) == self.others(self.before)

    def test_an_object_that_is_gone_leaves_the_map(self):
        outcome, after = self.go_on(self.gone)
        assert {o["id"] for o in after} == self.others(self.before)
        lines = [line for line in outcome.err.splitlines() if f"object {self.cup['id']} (class 41)" in line]
        assert len(lines) == 1, outcome
        assert "removed" in lines[0] or "no longer in its place" in lines[0], lines

    def test_nothing_moves_where_nothing_did(self):
        outcome, after = self.go_on(harness.clip("map_front")[-1])
        assert self.others(after) == self.others(self.before)
        assert not any("moved" in o for o in after)
        assert "removed" not in outcome.err

    def test_localize_reports_it_and_is_not_misled(self):
        out = os.path.join(self.folder, "found")
        for mode in ((), ("--every-frame",)):
            outcome = must_run("localize", "--map", harness.DESK_MAP, *harness.clip("map_front")[:-1], self.moved, "--out", out, *mode)
            presence = {o["id"]: o for o in harness.read_json(os.path.join(out, "presence.json"))}
            assert [o["id"] for o in presence.values() if o["missing"]] == [self.cup["id"]]
            assert presence[self.cup["id"]]["seen"] < 0.1 * presence[self.cup["id"]]["expected"]
            assert f"object {self.cup['id']} (cup): moved or gone" in outcome.err
            poses = harness.pairs(harness.read_tum(os.path.join(out, "poses.txt")), harness.read_tum(harness.groundtruth("map_front")))
            assert harness.rmse(harness.distances(poses, self.to_world)) < 0.02
