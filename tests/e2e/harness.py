"""Shared by the end-to-end tests: running the command, reading its files, comparing poses."""
import contextlib
import csv
import json
import os
import subprocess
import tempfile

import numpy as np
import pytest

BINARY = os.environ["OASLAM_BINARY"]
EXTRACT = os.environ.get("OASLAM_EXTRACT_FRAMES", "")
REARRANGE = os.environ.get("OASLAM_REARRANGE_MAP", "")
SAMPLE = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "data", "sample")
# What desk_test.py makes of the clip map_front: the folder of results, and the map. Tests that write to the map copy it.
DESK = os.path.join(os.environ["OASLAM_DESK"], "run")
DESK_MAP = os.path.join(os.environ["OASLAM_DESK"], "desk.map")

# The detector of the tests: no test finds, or leaves, one in the folders of the user.
MODELS = os.path.join(os.environ.get("OASLAM_DATA", "/nonexistent"), "models")
MODEL = os.path.join(MODELS, "yolox_nano.onnx")
os.environ.update(OASLAM_MODELS=MODELS, XDG_DATA_HOME="/nonexistent", XDG_STATE_HOME="/nonexistent")
needs_detector = pytest.mark.skipif(not os.path.exists(MODEL), reason="needs models/yolox_nano.onnx under OASLAM_DATA")


class Outcome:
    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    def __str__(self):
        return f"exit {self.code}\nstdout: {self.out[-2000:]}\nstderr: {self.err[-4000:]}"


def oaslam(*args, timeout=300, cwd=None):
    done = subprocess.run([BINARY, *map(str, args)], capture_output=True, text=True, timeout=timeout, cwd=cwd)
    return Outcome(done.returncode, done.stdout, done.stderr)


def must_run(*args, **options):
    outcome = oaslam(*args, **options)
    assert outcome.code == 0, outcome
    return outcome


class InFolder:
    """Tests of one class share a folder, and what `prepare` makes there. `cleanup` ends with them."""
    @pytest.fixture(autouse=True, scope="class")
    def prepared(self, request):
        cls = request.cls
        with contextlib.ExitStack() as cls.cleanup:
            cls.folder = cls.cleanup.enter_context(tempfile.TemporaryDirectory(prefix="oaslam_"))
            cls.prepare()
            yield

    @classmethod
    def prepare(cls):
        pass

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)


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


def rotation(q):
    """The matrix of a unit quaternion xyzw."""
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def similarity(matched):
    """(scale, rotation matrix, translation) that takes the estimate to the truth (Umeyama 1991)."""
    a, b = (np.array(side) for side in zip(*matched))
    from_a, from_b = a - a.mean(axis=0), b - b.mean(axis=0)
    u, _, vt = np.linalg.svd(from_b.T @ from_a)
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    scale = np.sum(from_b * (from_a @ turn.T)) / np.sum(from_a ** 2)
    return scale, turn, b.mean(axis=0) - scale * turn @ a.mean(axis=0)


def apply(sim, point):
    scale, turn, translation = sim
    return scale * turn @ point + translation


def distances(matched, sim):
    return [np.linalg.norm(apply(sim, a) - b) for a, b in matched]


def rmse(values):
    return np.sqrt(np.mean(np.square(values)))


def ate(path, clip_name):
    """The error of a trajectory of a clip of the sample in metres: RMSE after an alignment by a similarity."""
    matched = pairs(read_tum(path), read_tum(groundtruth(clip_name)))
    return rmse(distances(matched, similarity(matched)))


def map_alignment(folder=DESK, name="map_front"):
    """The similarity from the map of a run on a clip to the sample's world, in metres."""
    return similarity(pairs(read_tum(os.path.join(folder, "keyframes.txt")), read_tum(groundtruth(name))))
