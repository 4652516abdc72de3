"""Virtual content keeps its place on the bench and on an object when the map is saved and loaded, and in a run that is relocalized in it."""
import math
import os
import shutil

import harness
import numpy as np
from harness import must_run, oaslam
from sample_boxes import CX, CY, FOCAL, things

SPOT = (0.36, -0.1, 0.74)  # on the bench, in the sample's world
TEDDY = "teddy_17"


def anchors_of(map_file):
    """{name: (position, what it stands on)} as the command lists them."""
    listed = must_run("anchors", map_file)
    rows = [line.split() for line in listed.out.splitlines()[1:-1]]
    return {row[0]: ([float(x) for x in row[3:6]], " ".join(row[6:])) for row in rows}


class TestAnchors(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.map = shutil.copy(harness.DESK_MAP, cls.folder)
        cls.to_world = harness.map_alignment()
        cls.teddy = next(t for t in things() if t["name"] == TEDDY)["ellipsoid"]
        mapped = [o for o in harness.read_json(os.path.join(harness.DESK, "objects.json")) if o["category"] == "teddy bear"]
        cls.teddy_id = mapped[0]["id"]
        cls.placed = oaslam("anchors", cls.map, "--place", f"sign=flag@object:{cls.teddy_id}", "--place", f"tree=tree@keyframe:{cls.pixel_of(SPOT)}")

    @classmethod
    def pixel_of(cls, spot):
        """"ID:X,Y": a point of the world in the image of the first keyframe, projected with its true pose."""
        time, _, _ = harness.read_tum(os.path.join(harness.DESK, "keyframes.txt"))[0]
        _, position, q = min(harness.read_tum(harness.groundtruth("map_front")), key=lambda pose: abs(pose[0] - time))
        x, y, z = harness.rotation(q).T @ np.subtract(spot, position)
        return f"0:{FOCAL * x / z + CX:.2f},{FOCAL * y / z + CY:.2f}"

    def expect_in_place(self, anchors, to_world, tolerance):
        assert set(anchors) == {"sign", "tree"}
        top = [*self.teddy["center"][:2], self.teddy["center"][2] + self.teddy["semi_axes"][2]]
        assert math.dist(harness.apply(to_world, anchors["tree"][0]), SPOT) < tolerance
        assert math.dist(harness.apply(to_world, anchors["sign"][0]), top) < 0.05
        assert anchors["tree"][1] == "points"

    def test_they_stand_where_they_were_put(self):
        assert self.placed.code == 0, self.placed
        anchors = anchors_of(self.map)
        self.expect_in_place(anchors, self.to_world, 0.03)
        assert anchors["sign"][1] == f"object {self.teddy_id}"

    def test_they_are_found_again(self):
        out, again = os.path.join(self.folder, "around"), os.path.join(self.folder, "again.map")
        must_run("run", *harness.clip("query_around"), "--map-in", self.map, "--out", out, "--map-out", again)
        truth = harness.read_tum(harness.groundtruth("query_around"))
        to_world = harness.similarity(harness.pairs(harness.read_tum(os.path.join(out, "trajectory.txt")), truth))
        self.expect_in_place(anchors_of(again), to_world, 0.03)

    def test_they_are_edited(self):
        other = os.path.join(self.folder, "other.map")
        before = harness.read_bytes(self.map)
        outcome = must_run("anchors", self.map, "--rename", "tree=oak", "--delete", "sign", "--size", "tree=0.5", "--out", other)
        assert harness.read_bytes(self.map) == before
        assert set(anchors_of(other)) == {"oak"}
        assert outcome.out.splitlines()[1].split()[2] == "0.500"

    def test_bad_input(self):
        for arguments, message in (
                (("--place", "x"), "is not of the form NAME=MODEL@object:ID or NAME=MODEL@keyframe:ID:X,Y"),
                (("--place", "x=flag@object:99999"), "the map has no object 99999"),
                (("--place", "x=flag@object:-1"), '"-1" is not an id'),
                (("--place", "x=flag@keyframe:99999:3,4"), "the map has no keyframe 99999"),
                (("--place", "x=flag@keyframe:0:3"), "is not of the form"),
                (("--place", "x=flag@keyframe:0:a,b"), '"a,b" is not a pixel X,Y'),
                (("--place", "x=flag@table:0"), "is not of the form"),
                (("--place", f"sign=flag@object:{self.teddy_id}"), 'there is an anchor "sign" already'),
                (("--rename", "none=some"), 'there is no anchor "none"'),
                (("--size", "sign=0"), "must be from 1e-06 to"),
                (("--size", "sign=big"), '"big" is not a number'),
                (("--delete", "none"), "there is no anchor of this name")):
            before = harness.read_bytes(self.map)
            outcome = oaslam("anchors", self.map, *arguments)
            assert outcome.code == 1, outcome
            assert message in outcome.err
            assert len(outcome.err.strip().splitlines()) == 1, outcome
            assert harness.read_bytes(self.map) == before
