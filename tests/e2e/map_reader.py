"""Reads a map file with SQLite only, without the program."""
import sqlite3
import struct


class MapFile:
    def __init__(self, path):
        db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        db.row_factory = sqlite3.Row
        self.cameras = {r["id"]: dict(r) for r in db.execute("SELECT * FROM cameras")}
        self.keyframes = {}
        for r in db.execute("SELECT * FROM keyframes ORDER BY id"):
            q, t = ([r[f"cam_from_world_{c}"] for c in names] for names in (("qx", "qy", "qz", "qw"), ("tx", "ty", "tz")))
            self.keyframes[r["id"]] = {"time": r["timestamp"], "camera": r["camera"], "q": q, "t": t}
        self.keypoints = {r["keyframe"]: [k[:2] for k in struct.iter_unpack("<fffi", r["keypoints"])]
                          for r in db.execute("SELECT keyframe, keypoints FROM features")}
        self.landmarks = {r["id"]: (r["x"], r["y"], r["z"]) for r in db.execute("SELECT id, x, y, z FROM landmarks ORDER BY id")}
        self.observations = [tuple(r) for r in db.execute("SELECT landmark, keyframe, keypoint FROM observations ORDER BY landmark, keyframe")]
        self.names = dict(tuple(r) for r in db.execute("SELECT category_id, name FROM class_names"))
        self.objects = {}
        for r in db.execute("SELECT * FROM objects WHERE state = 'mapped' ORDER BY id"):
            self.objects[r["id"]] = {
                "label": r["name"] or self.names[r["category_id"]], "category": r["category_id"],
                "center": [r[f"center_{a}"] for a in "xyz"], "half_axes": [r[f"half_axis_{a}"] for a in "xyz"],
                "q": [r[f"world_from_object_q{a}"] for a in "xyzw"]}
        db.close()
