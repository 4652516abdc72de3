"""Parts and movable classes of a class file, on the sample. Boxes of parts are derived from the true ellipsoids."""
import json
import math
import os
import random
import sqlite3
import struct

import harness
import numpy as np
from harness import must_run
from sample_boxes import HEIGHT, WIDTH, detect, project, things

BENCH = (0, 0, 0.85)  # its middle
TOP, BOTTOM = 200, 300  # + the category of the whole
TALL = {"bottle": 39, "cup": 41, "vase": 75, "teddy bear": 77, "potted plant": 58, "tv": 62, "chair": 56, "sports ball": 32, "bowl": 45}


def parts_of(thing):
    """(category, centre, half axes along the world's x y z turned by its rotation) of the upper and the lower half of an upright ellipsoid."""
    e = thing["ellipsoid"]
    a, b, c = e["semi_axes"]
    for base, side in ((TOP, 1), (BOTTOM, -1)):
        yield base + thing["category_id"], [e["center"][0], e["center"][1], e["center"][2] + side * c / 2], (0.9 * a, 0.9 * b, c / 2), e["rotation"]


def detect_parts(wholes, position, quaternion, rng):
    found = [detect(category, project(*part, position, quaternion), rng, 0.6) for thing in wholes for category, *part in parts_of(thing)]
    return [d for d in found if d]


class TestParts(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.wholes = [t for t in things() if t["category"] in TALL]
        rng = random.Random(1)
        cls.truth = harness.read_tum(harness.groundtruth("map_front"))
        detections = harness.read_json(os.path.join(harness.SAMPLE, "map_front", "detections.json"))
        for entry, (_, position, quaternion) in zip(detections, cls.truth, strict=True):
            entry["detections"] += detect_parts(cls.wholes, position, quaternion, rng)
        cls.detections = cls.write_json("with_parts.json", detections)
        cls.classes = cls.write("classes.yaml", cls.class_file(True))
        cls.map, cls.out = os.path.join(cls.folder, "parts.map"), os.path.join(cls.folder, "map")
        must_run("map-objects", "--trajectory", harness.groundtruth("map_front"), "--camera", cls.camera(), "--detections", cls.detections,
                 "--classes", cls.classes, "--out", cls.out, "--map-out", cls.map)

    @staticmethod
    def camera():
        return os.path.join(harness.SAMPLE, "map_front", "camera.yaml")

    @staticmethod
    def class_file(with_parts):
        names = {t["category_id"]: t["category"] for t in things()}
        parts = {base + c: f"{what} of {name}" for base, what in ((TOP, "top"), (BOTTOM, "bottom")) for name, c in TALL.items()}
        text = "names:\n" + "".join(f"  {c}: {n}\n" for c, n in {**names, **parts}.items())
        wholes = {name: name.split(" of ")[1] for name in parts.values()}
        return text + ("parts:\n" + "".join(f"  {p}: {w}\n" for p, w in wholes.items()) if with_parts else "")

    @classmethod
    def write(cls, name, text):
        path = os.path.join(cls.folder, name)
        with open(path, "w") as f:
            f.write(text)
        return path

    @classmethod
    def write_json(cls, name, value):
        return cls.write(name, json.dumps(value))

    def localize(self, name, detections, classes=None, the_map=None):
        folder = os.path.join(self.folder, name)
        must_run("localize", "--map", the_map or self.map, "--camera", self.camera(), "--detections", detections, "--relocalization", "objects", "--every-frame",
                 "--out", folder, *(("--classes", classes) if classes else ()))
        return harness.read_tum(os.path.join(folder, "poses.txt"))

    def lines(self, *path):
        with open(os.path.join(self.folder, *path)) as f:
            return [line for line in f if line.strip() and not line.startswith("#")]

    def near_views(self, wholes):
        """Localizes cameras 0.6 m in front of the centre of the bench, over the arc of the map, by boxes of parts only or of wholes only."""
        rng = random.Random(2)
        views, poses = [], {}
        for i, (_, position, quaternion) in enumerate(self.truth[::3]):
            ahead = harness.rotation(quaternion)[:, 2]
            near = position + ((np.array(BENCH) - position) @ ahead - (0.55 + 0.1 * rng.random())) * ahead
            found = [] if wholes else detect_parts(self.wholes, near, quaternion, rng)
            for e, category in [(t["ellipsoid"], t["category_id"]) for t in self.wholes] if wholes else ():
                box = project(e["center"], e["semi_axes"], e["rotation"], near, quaternion)
                fits = box and box[0] > 0 and box[1] > 0 and box[2] < WIDTH and box[3] < HEIGHT
                found += [d for d in [detect(category, box, rng, 0.9)] if d and fits]
            time = round(1 + i / 30, 6)
            poses[time] = near
            views.append({"file_name": f"{time:.6f}.jpg", "detections": found})
        return views, poses

    def test_parts_are_objects_beside_their_wholes(self):
        objects = harness.read_json(os.path.join(self.out, "objects.json"))
        by_id = {o["id"]: o for o in objects}
        wholes = [o for o in objects if o["category_id"] < TOP]
        parts = [o for o in objects if o["category_id"] >= TOP]
        assert len(wholes) >= 19
        assert len(parts) > 1.6 * len(self.wholes)
        assert len(parts) <= 2 * len(self.wholes)
        assert all("part_of" not in o for o in wholes)
        placed = [o for o in parts if "part_of" in o]
        assert len(placed) > 0.8 * len(parts)
        for o in placed:
            assert by_id[o["part_of"]]["category_id"] == o["category_id"] % 100

    def test_a_near_camera_that_sees_only_parts_finds_its_pose(self):
        views, truth = self.near_views(wholes=False)
        poses = self.localize("near", self.write_json("near.json", views))
        errors = sorted(math.dist(p, truth[round(t, 6)]) for t, p, _ in poses)
        assert len(errors) > 0.7 * len(views)
        assert errors[len(errors) // 2] < 0.03
        assert errors[int(0.97 * len(errors))] < 0.1
        # Fewer images contain enough wholes.
        whole_views, _ = self.near_views(wholes=True)
        by_wholes = self.localize("near_wholes", self.write_json("near_wholes.json", whole_views))
        assert len(by_wholes) < 0.6 * len(errors)
        # A map without the relation of parts expects the wholes to be detected.
        self.localize("strangers", os.path.join(self.folder, "near.json"), classes=self.write("plain.yaml", self.class_file(False)))
        known, unknown = ({round(float(line.split()[0]), 6): float(line.split()[-1]) for line in reversed(self.lines(name, "candidates.txt"))}
                          for name in ("near", "strangers"))
        assert all(known[t] >= unknown[t] - 1e-6 for t in known if t in unknown)
        assert sum(known[t] > unknown[t] + 1 for t in known if t in unknown) > 0.1 * len(known)

    def test_the_map_keeps_what_is_a_part(self):
        with sqlite3.connect(self.map) as db:
            parts = db.execute("SELECT value FROM meta WHERE key = 'parts'").fetchone()[0].split()
        assert len(parts) == 2 * len(TALL)
        assert "239:39" in parts


class TestMovable:
    """tv and chair are movable classes: neither they nor key points in their boxes are mapped."""

    def test_what_moves_stays_out_of_the_map(self, tmp_path):
        classes, path, out = (os.path.join(tmp_path, name) for name in ("classes.yaml", "desk.map", "out"))
        with open(classes, "w") as f:
            f.write("movable: [tv, chair]\n")
        clip = harness.clip("map_front")
        must_run("run", *clip, "--to", "300", "--classes", classes, "--out", out, "--map-out", path)
        objects = harness.read_json(os.path.join(out, "objects.json"))
        assert len(objects) >= 12
        assert not {o["category"] for o in objects} & {"tv", "chair"}
        assert len(harness.read_tum(os.path.join(out, "trajectory.txt"))) > 280
        boxes = {i: [d["bbox"] for d in e["detections"] if d["category_id"] in (56, 62) and d["detection_score"] >= 0.3]
                 for i, e in enumerate(harness.read_json(clip[-1]))}
        with sqlite3.connect(path) as db:
            keyframes = db.execute("SELECT k.frame_index, f.count, f.keypoints FROM keyframes k JOIN features f ON f.keyframe = k.id").fetchall()
            assert db.execute("SELECT value FROM meta WHERE key = 'movable'").fetchone()[0] == "56 62"
        covered = points = 0
        for frame, count, blob in keyframes:
            covered += len(boxes[frame])
            for x, y, _, _ in struct.iter_unpack("<fffi", blob):
                points += 1
                assert not any(b[0] < x + 0.5 < b[2] and b[1] < y + 0.5 < b[3] for b in boxes[frame]), (frame, x, y)
        assert covered > len(keyframes)
        assert points > 500 * len(keyframes)
        # Set for a map that exists already, the relations apply from then on.
        again = os.path.join(tmp_path, "again")
        with open(classes, "w") as f:
            f.write("movable: [cup]\n")
        found = must_run("localize", "--map", path, *harness.clip("query_around"), "--to", "30", "--every-frame", "--classes", classes, "--out", again)
        assert "its class moves" in found.err
        assert len(harness.read_tum(os.path.join(again, "poses.txt"))) > 20
