"""Another day in a flat: going on in the map of the day before, where some things have been moved since; and joining maps of walks that share one room.

Needs flat31_walk_a and flat31_walk_b under OASLAM_DATA, and is skipped (77) without them.
"""
import re
import math
import os

import harness
import pytest
from harness import must_run, oaslam
from map_reader import MapFile
from sample_boxes import HEIGHT, WIDTH, iou, project  # the camera of the walks is that of the sample

DATA = os.environ.get("OASLAM_DATA", "")
DAY_A, DAY_B = (os.path.join(DATA, f"flat31_walk_{day}") for day in "ab")
WELL_SEEN = 30  # images of each day
SAME_PLACE = 0.75  # longest half axes, as in `oaslam evaluate objects`
MIN_SCORE = 0.5  # objects.min_score


def walk(folder, first=None, end=None):
    """Options that name a walk, or its images from `first` on, before `end`."""
    part = (["--from", first] if first is not None else []) + (["--to", end] if end is not None else [])
    return ["--images", f"{folder}/video.mp4", "--camera", f"{folder}/camera.yaml", "--detections", f"{folder}/detections.json", *part]


def truth_of(folder):
    return harness.read_tum(os.path.join(folder, "groundtruth.txt"))


def things_of(folder):
    return {o["name"]: o for o in harness.read_json(os.path.join(folder, "objects_gt.json"))["objects"]}


def images_of(thing, folder):
    """The number of images of a walk with a detection in the place of a thing."""
    shape, count = thing["ellipsoid"], 0
    for entry, (_, position, quaternion) in zip(harness.read_json(os.path.join(folder, "detections.json")), truth_of(folder), strict=True):
        boxes = [d["bbox"] for d in entry["detections"] if d["category_id"] == thing["category_id"] and d["detection_score"] > MIN_SCORE]
        if boxes and (expected := project(shape["center"], shape["semi_axes"], shape["rotation"], position, quaternion)):
            expected = [min(max(edge, 0), (WIDTH, HEIGHT)[i % 2]) for i, edge in enumerate(expected)]
            count += any(iou(box, expected) > 0.25 for box in boxes)
    return count


def share_off(an_object, thing, to_world):
    """The distance between the centres of an object and of a true thing, in longest half axes of the thing."""
    return math.dist(harness.apply(to_world, an_object["center"]), thing["ellipsoid"]["center"]) / max(thing["ellipsoid"]["semi_axes"])


def told_apart(objects, things, to_world):
    """The object in the place of each thing, by name: one to one, the nearest ones first; and the objects that are left over."""
    pairs = sorted((off, o["id"], name) for o in objects for name, thing in things.items()
                   if o["category_id"] == thing["category_id"] and (off := share_off(o, thing, to_world)) < SAME_PLACE)
    standing, taken = {}, set()
    for _, number, name in pairs:
        if name not in standing and number not in taken:
            standing[name] = number
            taken.add(number)
    return standing, [o for o in objects if o["id"] not in taken]


def aligned(poses, folder):
    return harness.similarity(harness.pairs(poses, truth_of(folder)))


pytestmark = pytest.mark.skipif(not (os.path.isdir(DAY_A) and os.path.isdir(DAY_B)), reason="needs flat31_walk_a and flat31_walk_b under OASLAM_DATA")


class TestDays(harness.InFolder):
    """One map of day A, gone on with on day B."""

    @classmethod
    def prepare(cls):
        cls.out_a, cls.out_b, map_a = (cls.path(name) for name in ("a", "b", "a.map"))
        cls.joint = cls.path("joint.map")
        must_run("run", *walk(DAY_A), "--out", cls.out_a, "--map-out", map_a)
        must_run("run", *walk(DAY_B), "--map-in", map_a, "--out", cls.out_b, "--map-out", cls.joint)

    def setup_method(self):
        self.poses = harness.read_tum(os.path.join(self.out_b, "trajectory.txt"))
        self.a_to_world = aligned(harness.read_tum(os.path.join(self.out_a, "keyframes.txt")), DAY_A)
        self.to_world = aligned(self.poses, DAY_B)
        self.before, self.after = (harness.read_json(os.path.join(out, "objects.json")) for out in (self.out_a, self.out_b))
        self.things_a, self.things_b = things_of(DAY_A), things_of(DAY_B)
        # Those that were moved and are seen well on both days.
        self.moved = [name for name, thing in self.things_b.items() if thing["moved"] and images_of(self.things_a[name], DAY_A) >= WELL_SEEN
                      and images_of(thing, DAY_B) >= WELL_SEEN]

    def test_the_camera_is_found_and_tracked(self):
        # The first ten seconds show nothing that the first walk has seen from that side.
        frames = harness.read_csv(os.path.join(self.out_b, "frames.csv"))
        assert len(self.poses) > 0.85 * len(frames)
        live = harness.read_tum(os.path.join(self.out_b, "trajectory_live.txt"))
        assert len(live) > 0.55 * len(frames)

    def test_poses_are_right(self):
        matched = harness.pairs(self.poses, truth_of(DAY_B))
        assert harness.rmse(harness.distances(matched, self.to_world)) < 0.15
        # In the frame of day A, whose own map may be bent by some decimetres; another room would be metres away.
        in_the_old_frame = sorted(harness.distances(matched, self.a_to_world))
        assert in_the_old_frame[len(matched) // 2] < 0.25
        assert in_the_old_frame[int(0.95 * len(matched))] < 0.5
        assert in_the_old_frame[-1] < 1.5

    def test_the_map_of_both_days_has_more_than_either(self):
        before, _ = told_apart(self.before, self.things_a, self.a_to_world)
        after, _ = told_apart(self.after, self.things_b, self.to_world)
        stayed = {name for name in before if not self.things_b[name]["moved"]}
        assert len(after) > 0.7 * len(self.things_b)
        assert len(after) > len(stayed)
        lost = stayed - set(after)
        assert len(lost) <= 4, lost

    def test_moved_things_stand_in_their_new_place(self):
        assert len(self.moved) >= 3
        standing, _ = told_apart(self.after, self.things_b, self.to_world)
        # One may fail: the last bits of the arithmetic differ between processors, and a walk through rooms comes out differently.
        assert len(set(self.moved) - set(standing)) <= 1

    def left_behind(self):
        """The things that were moved of which an object still stands in the old place."""
        _, others = told_apart(self.after, self.things_b, self.to_world)
        return [name for name, thing in self.things_b.items() if thing["moved"] and any(
            o["category_id"] == thing["category_id"] and share_off(o, self.things_a[name], self.to_world) < SAME_PLACE for o in others)]

    def test_what_is_looked_through_is_found_out(self):
        # On day B landmarks are seen through the old places of a ball and a bottle; the other things are too flat, or nobody looks that way.
        looked_through = {"ball_18", "bottle_30"}
        assert looked_through <= set(told_apart(self.before, self.things_a, self.a_to_world)[0])
        # One may fail, as above.
        assert len(looked_through & set(self.left_behind())) < 2

    @pytest.mark.xfail(strict=True)  # what nobody looks through, or watches for seconds, is not given up (objects/presence, objects/sight_lines)
    def test_moved_things_stand_nowhere_else(self):
        assert not set(self.moved) & set(self.left_behind())

    def test_moved_things_stand_once_in_their_new_place(self):
        _, others = told_apart(self.after, self.things_b, self.to_world)
        for name in self.moved:
            twice = [o["id"] for o in others if o["category_id"] == self.things_b[name]["category_id"] and share_off(o, self.things_b[name], self.to_world) < SAME_PLACE]
            assert not twice, name

    def test_cameras_of_both_days_are_kept(self):
        shown = must_run("info", self.joint)
        for name in ("flat31_walk_a", "flat31_walk_b"):
            assert re.search(rf"camera \d+ +{name}", shown.out)


class TestRooms(harness.InFolder):
    """Maps of parts of the walks, each of one room or two."""

    PARTS = {"kitchen and office": (DAY_A, 650, 1100), "office and living room": (DAY_A, 1860, 2100), "office on day B": (DAY_B, 340, 600),
             "living room": (DAY_A, 1160, 1450), "kitchen on day B": (DAY_B, 680, 850)}

    @classmethod
    def prepare(cls):
        for name, part in cls.PARTS.items():
            must_run("run", *walk(*part), "--out", cls.path(name), "--map-out", cls.path(name + ".map"))
        os.symlink(harness.DESK_MAP, cls.path("desk.map"))

    def merge(self, first, second, *args):
        out = self.path("merged.map")
        if os.path.exists(out):
            os.remove(out)
        return oaslam("merge", self.path(first + ".map"), self.path(second + ".map"), "--out", out, *args), out

    def test_walks_that_share_one_room(self):
        first = "kitchen and office"
        merging, out = self.merge(first, "office and living room")
        assert merging.code == 0, merging
        assert re.search(r"[1-9]\d* of \d+ keyframes of the (first|second) map are found in the (first|second) \(\d+ by points and \d+ by objects agree", merging.out)
        trajectories = self.path("trajectories")
        must_run("export", "--map", out, "--format", "tum", "--out", trajectories)  # a file for each of the two recordings
        poses = [pose for name in sorted(os.listdir(trajectories)) for pose in harness.read_tum(os.path.join(trajectories, name))]
        matched = harness.pairs(poses, truth_of(DAY_A))
        assert len(matched) > 500  # of both parts
        assert harness.rmse(harness.distances(matched, harness.similarity(matched))) < 0.1

    def test_days_that_share_one_room(self):
        merging, out = self.merge("kitchen and office", "office on day B")
        assert merging.code == 0, merging
        assert "keyframes of the" in merging.out
        merged = MapFile(out)
        assert len(merged.cameras) == 2
        # What the two parts have in common stands once: no more of a class than there are.
        true = [t["category"] for t in things_of(DAY_B).values()]
        objects = [o["label"] for o in merged.objects.values()]
        assert len(objects) > 8
        for category in set(objects):
            assert objects.count(category) <= true.count(category) + 1, f"{category}: {objects}"

    def test_rooms_that_merely_look_alike_are_refused(self):
        # Two rooms of the flat (the same wall paint, windows, posters, chairs, cups and books), and another place with things of the same classes.
        for first, second in (("living room", "kitchen on day B"), ("living room", "office on day B"), ("office on day B", "kitchen on day B"),
                              ("desk", "kitchen and office"), ("living room", "desk")):
            for args in ([], ["--relocalization", "objects"]):
                merging, out = self.merge(first, second, *args)
                assert merging.code == 1, (first, second, merging)
                assert "are not merged" in merging.err
                assert re.search(r"\d+ of \d+ keyframes of the second map are found in the first", merging.err)
                assert not os.path.exists(out)
