"""Shared by the end-to-end tests: running the command, reading its files, comparing poses. Python's standard library only."""
import csv
import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest

BINARY = os.environ["OASLAM_BINARY"]
EXTRACT = os.environ.get("OASLAM_EXTRACT_FRAMES", "")
REARRANGE = os.environ.get("OASLAM_REARRANGE_MAP", "")
SAMPLE = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "data", "sample")

# The detector of the tests: no test finds, or leaves, one in the folders of the user.
MODELS = os.path.join(os.environ.get("OASLAM_DATA", "/nonexistent"), "models")
MODEL = os.path.join(MODELS, "yolox_nano.onnx")
os.environ.update(OASLAM_MODELS=MODELS, XDG_DATA_HOME="/nonexistent", XDG_STATE_HOME="/nonexistent")
needs_detector = unittest.skipUnless(os.path.exists(MODEL), "needs models/yolox_nano.onnx under OASLAM_DATA")


class Outcome:
    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    def __str__(self):
        return f"exit {self.code}\nstdout: {self.out[-2000:]}\nstderr: {self.err[-4000:]}"


def oaslam(*args, timeout=300, cwd=None):
    done = subprocess.run([BINARY, *map(str, args)], capture_output=True, text=True, timeout=timeout, cwd=cwd)
    return Outcome(done.returncode, done.stdout, done.stderr)


class InFolder(unittest.TestCase):
    """Tests of one class share a folder, and what the class runs beforehand, each of which must succeed."""
    made = ()  # outcomes

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="oaslam_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def setUp(self):
        for run in self.made:
            self.assertEqual(run.code, 0, run)


def clip(name):
    """Options that name a clip of the sample."""
    folder = os.path.join(SAMPLE, name)
    return ["--images", f"{folder}/video.mp4", "--camera", f"{folder}/camera.yaml", "--detections", f"{folder}/detections.json"]


def groundtruth(name):
    return os.path.join(SAMPLE, name, "groundtruth.txt")


def read_csv(path):
    with open(path) as f:
        return list(csv.DictReader(f))


def read_json(path):
    with open(path) as f:
        return json.load(f)


def read_bytes(path):
    with open(path, "rb") as f:
        return f.read()


def read_tum(path):
    """[(time, position, quaternion xyzw)], sorted by time."""
    poses = []
    with open(path) as f:
        for line in f:
            if line.strip() and not line.startswith("#"):
                v = [float(x) for x in line.split()]
                poses.append((v[0], v[1:4], v[4:8]))
    return sorted(poses)


def pairs(estimate, truth, max_dt=0.01):
    """Positions (estimate, truth) of poses of the same time."""
    by_time = {round(t / max_dt): p for t, p, _ in truth}
    found = []
    for t, p, _ in estimate:
        match = by_time.get(round(t / max_dt))
        if match is not None:
            found.append((p, match))
    return found


def rotate(q, v):
    x, y, z, w = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx]


def largest_eigenvector(matrix):
    """The eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi rotations."""
    n = len(matrix)
    a = [row[:] for row in matrix]
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    for _ in range(60):
        off, p, q = max((abs(a[i][j]), i, j) for i in range(n) for j in range(i + 1, n))
        if off < 1e-14:
            break
        angle = 0.5 * math.atan2(2 * a[p][q], a[q][q] - a[p][p])
        c, s = math.cos(angle), math.sin(angle)
        for m in (a, v):
            for row in m:
                row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
        a[p], a[q] = [c * x - s * y for x, y in zip(a[p], a[q])], [s * x + c * y for x, y in zip(a[p], a[q])]
    best = max(range(n), key=lambda i: a[i][i])
    return [v[i][best] for i in range(n)]


def similarity(matched):
    """(scale, quaternion xyzw, translation) that takes the estimate to the truth (Horn 1987, closed form by quaternions)."""
    n = len(matched)
    mean_a = [sum(a[i] for a, _ in matched) / n for i in range(3)]
    mean_b = [sum(b[i] for _, b in matched) / n for i in range(3)]
    s = [[0.0] * 3 for _ in range(3)]
    norm_a = norm_b = 0.0
    for a, b in matched:
        da, db = [a[i] - mean_a[i] for i in range(3)], [b[i] - mean_b[i] for i in range(3)]
        norm_a += sum(x * x for x in da)
        norm_b += sum(x * x for x in db)
        for i in range(3):
            for j in range(3):
                s[i][j] += da[i] * db[j]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = s
    k = [[xx + yy + zz, yz - zy, zx - xz, xy - yx],
         [yz - zy, xx - yy - zz, xy + yx, zx + xz],
         [zx - xz, xy + yx, yy - xx - zz, yz + zy],
         [xy - yx, zx + xz, yz + zy, zz - xx - yy]]
    w, x, y, z = largest_eigenvector(k)
    q = [x, y, z, w]
    scale = sum(sum(rotate(q, [a[i] - mean_a[i] for i in range(3)])[j] * (b[j] - mean_b[j]) for j in range(3))
                for a, b in matched) / norm_a
    moved = rotate(q, mean_a)
    return scale, q, [mean_b[i] - scale * moved[i] for i in range(3)]


def apply(sim, point):
    scale, q, t = sim
    moved = rotate(q, point)
    return [scale * moved[i] + t[i] for i in range(3)]


def distances(matched, sim):
    return [math.dist(apply(sim, a), b) for a, b in matched]


def rmse(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def map_alignment(folder, name="map_front"):
    """The similarity from the map of a run on a clip to the sample's world, in metres."""
    return similarity(pairs(read_tum(os.path.join(folder, "keyframes.txt")), read_tum(groundtruth(name))))
