"""Shared by the programs of tools/: reads true objects (objects_gt.json), finds which detection shows which of them, and compares a map's objects. Needs numpy."""
import collections
import os
import re

import numpy as np

import runs

MIN_SCORE = 0.5  # objects.min_score: detections at or below are not mapped
MIN_BOX_IOU = 0.25  # of a detection with the box of the true object it shows; low, since the object may be partly hidden
MAX_CENTRE = 0.75  # of the longest half axis: the rule of `oaslam evaluate objects`
NEAR = 0.05  # metres

TrueObject = collections.namedtuple("TrueObject", "name category category_id center half_axes rotation corners moved")
MapObject = collections.namedtuple("MapObject", "id category category_id center half_axes rotation observations center_variance entry")
Seen = collections.namedtuple("Seen", "image box is_cut position")


def rotation(q):
    x, y, z, w = np.asarray(q, float) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


# ---------------------------------------------------------------- the truth
def read_truth(folder):
    true = []
    for o in runs.read_json(os.path.join(folder, "objects_gt.json"))["objects"]:
        e = o["ellipsoid"]
        true.append(TrueObject(o["name"], o["category"], o["category_id"], np.array(e["center"]), np.array(e["semi_axes"]), np.array(e["rotation"]),
                               np.array(o["obb_corners"]), o.get("moved", False)))
    return true


class Pinhole:
    """The camera of a sequence without distortion."""

    def __init__(self, folder):
        path = os.path.join(folder, "camera.yaml")
        _, k, tail = runs.calibration(path)
        with open(path) as f:
            self.width, self.height = (int(v) for v in re.search(r"image_width: *(\d+)\s+image_height: *(\d+)", f.read()).groups())
        self.fx, self.cx, self.fy, self.cy = k[0], k[2], k[4], k[5]
        self.is_distorted = any(float(v) for v in re.search(r"data: *\[([^\]]*)\]", tail).group(1).split(","))

    def box(self, corners, position, world_from_camera):
        """The box in the image of what has these eight corners; None where it is not in the image."""
        points = (corners - position) @ world_from_camera
        edges = [(i, j) for i in range(8) for j in range(i)]  # of the hull, and some inside it
        front = [points[i] for i in range(8) if points[i, 2] >= NEAR]
        for i, j in edges:
            a, b = points[i], points[j]
            if (a[2] < NEAR) != (b[2] < NEAR):
                front.append(a + (NEAR - a[2]) / (b[2] - a[2]) * (b - a))
        if not front:
            return None
        front = np.array(front)
        x, y = self.fx * front[:, 0] / front[:, 2] + self.cx + 0.5, self.fy * front[:, 1] / front[:, 2] + self.cy + 0.5
        box = np.array([max(x.min(), 0), max(y.min(), 0), min(x.max(), self.width), min(y.max(), self.height)])
        return box if box[2] > box[0] and box[3] > box[1] else None

    def is_cut(self, box):
        return box[0] <= 2 or box[1] <= 2 or box[2] >= self.width - 2 or box[3] >= self.height - 2


def box_iou(a, b):
    w, h = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    both = max(w, 0) * max(h, 0)
    return both / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - both)


def read_poses(path):
    """[time, x, y, z, qx, qy, qz, qw] of each line, by time."""
    return np.array(sorted([float(v) for v in row[:8]] for row in runs.read_rows(path)))


def detections_of(folder, true):
    """The detections of each true thing, by name: where the box of its true shape overlaps a detection of its class most, one to one."""
    camera, poses = Pinhole(folder), read_poses(os.path.join(folder, "groundtruth.txt"))
    if camera.is_distorted:
        raise ValueError(f"{folder}: a lens with distortion")
    of_class = collections.defaultdict(list)
    for o in true:
        of_class[o.category_id].append(o)
    seen = {o.name: [] for o in true}
    for image in runs.read_json(os.path.join(folder, "detections.json")):
        number = int(re.search(r"\d+", image["file_name"]).group())
        position, turned = poses[number, 1:4], rotation(poses[number, 4:8])
        pairs = []
        for d in image["detections"]:
            if d["detection_score"] <= MIN_SCORE:
                continue
            for o in of_class[d["category_id"]]:
                if np.linalg.norm(o.center - position) > 15 or (box := camera.box(o.corners, position, turned)) is None:
                    continue
                if (overlap := box_iou(box, d["bbox"])) >= MIN_BOX_IOU:
                    pairs.append((overlap, o.name, d["bbox"]))
        taken = set()
        for _, name, box in sorted(pairs, key=lambda p: -p[0]):
            if name not in taken and tuple(box) not in taken:
                taken |= {name, tuple(box)}
                seen[name].append(Seen(number, box, camera.is_cut(box), position))
    return seen


def view_angle(views, center):
    """The widest angle between two of the directions from which something was seen, in degrees."""
    if len(views) < 2:
        return 0.0
    d = np.array([v.position for v in views]) - center
    d /= np.linalg.norm(d, axis=1)[:, None]
    return float(np.degrees(np.arccos(np.clip((d @ d.T).min(), -1, 1))))


# ---------------------------------------------------------------- a map
class Alignment:
    """The similarity from a map to the truth, by the poses of a trajectory that are at most `max_dt` seconds from a true one."""

    def __init__(self, trajectory, truth, max_dt=0.02):
        a, b = read_poses(trajectory), read_poses(truth)
        i = np.clip(np.searchsorted(b[:, 0], a[:, 0]), 1, len(b) - 1)
        i = np.where(abs(b[i - 1, 0] - a[:, 0]) < abs(b[i, 0] - a[:, 0]), i - 1, i)
        ok = abs(b[i, 0] - a[:, 0]) <= max_dt
        x, y = a[ok, 1:4], b[i[ok], 1:4]
        mx, my = x.mean(0), y.mean(0)
        u, d, vt = np.linalg.svd((y - my).T @ (x - mx) / len(x))
        sign = np.diag([1, 1, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
        self.rotation = u @ sign @ vt
        self.scale = (d * np.diag(sign)).sum() / ((x - mx) ** 2).sum(1).mean()
        self.translation = my - self.scale * self.rotation @ mx
        self.times, self.errors = a[ok, 0], np.linalg.norm(self(x.T).T - y, axis=1)

    def __call__(self, points):
        return self.scale * self.rotation @ points + (self.translation if points.ndim == 1 else self.translation[:, None])

    def inverse(self, point):
        return self.rotation.T @ (point - self.translation) / self.scale

    def rmse(self):
        return float(np.sqrt((self.errors ** 2).mean()))


def read_objects(path):
    """objects.json of a run, in the frame and unit of its map."""
    return [MapObject(o["id"], o["category"], o["category_id"], np.array(o["center"]), np.array(o["half_axes"]), rotation(o["rotation"]), o["observations"],
                      np.array(o["covariance_diag"][:3]), o) for o in runs.read_json(path)]


def match(objects, true, align):
    """The true thing of each object, or None, by the rule of `oaslam evaluate objects`: in the order of the objects, that of its class which is nearest, in
    units of its longest half axis, and not taken."""
    taken, found = set(), []
    for o in objects:
        near = [(np.linalg.norm(align(o.center) - t.center) / t.half_axes.max(), n) for n, t in enumerate(true)
                if t.category_id == o.category_id and n not in taken]
        share, n = min(near, default=(MAX_CENTRE, -1))
        found.append(n if share < MAX_CENTRE else None)
        taken.add(n if share < MAX_CENTRE else None)
    return found


def volume_iou(o, t, align, cells=32):
    """Intersection over union of the ellipsoids of a map's object and of a true one, by a grid of points over both."""
    center, axes, turned = align(o.center), align.scale * o.half_axes, align.rotation @ o.rotation
    reach = [np.sqrt(((r * a) ** 2).sum(1)) for r, a in ((turned, axes), (t.rotation, t.half_axes))]
    low, high = np.minimum(center - reach[0], t.center - reach[1]), np.maximum(center + reach[0], t.center + reach[1])
    grid = np.stack(np.meshgrid(*((np.arange(cells) + 0.5) / cells * (h - l) + l for l, h in zip(low, high)), indexing="ij"), -1).reshape(-1, 3)
    a, b = ((((grid - c) @ r / h) ** 2).sum(1) <= 1 for c, r, h in ((center, turned, axes), (t.center, t.rotation, t.half_axes)))
    return float((a & b).sum() / max((a | b).sum(), 1))
