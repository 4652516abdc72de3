"""run --gravity: the map's vertical from a sensor."""
import math
import os
import re

import numpy as np

import harness
from harness import must_run, oaslam

FRAMES = 120


def degrees_off(up, keyframes):
    """Between the map's vertical and the true one, which is z: the vertical is taken into the true world by the rotation of each keyframe."""
    truth = harness.read_tum(harness.groundtruth("map_front"))
    ups = []
    for t, _, q in harness.read_tum(keyframes):
        at, _, true_q = min(truth, key=lambda pose: abs(pose[0] - t))
        assert abs(at - t) < 0.02
        ups.append(harness.rotation(true_q) @ harness.rotation(q).T @ up)
    mean = np.mean(ups, axis=0)
    return math.degrees(math.atan2(math.hypot(mean[0], mean[1]), mean[2]))


class TestGravity(harness.InFolder):
    def samples(self, name, later=0.0, step=3):
        """Samples of a slow, slightly noisy sensor in the true camera."""
        path = os.path.join(self.folder, name)
        with open(path, "w") as f:
            f.write("# timestamp gx gy gz\n")
            for i, (t, _, q) in enumerate(harness.read_tum(harness.groundtruth("map_front"))):
                if i % step == 0:
                    down = [0.3 * math.sin(2.0 * i), 0.3 * math.cos(2.9 * i), -9.81]
                    f.write(f"{t + later:.6f} " + " ".join(f"{g:.5f}" for g in harness.rotation(q).T @ down) + "\n")
        return path

    def run_with(self, name, *args):
        out, saved = os.path.join(self.folder, name), os.path.join(self.folder, name + ".map")
        outcome = must_run("run", *harness.clip("map_front"), "--to", FRAMES, "--out", out, "--map-out", saved, *args)
        return outcome, saved

    def test_the_vertical_is_measured(self):
        outcome, saved = self.run_with("measured", "--gravity", self.samples("gravity.txt"))
        assert "no sample" not in outcome.err
        up = re.search(r"^up +(\S+) (\S+) (\S+) \(gravity measured in \d+ keyframes", oaslam("info", saved).out, re.M).groups()
        assert degrees_off(np.array(up, float), os.path.join(self.folder, "measured", "keyframes.txt")) < 1.5

    def test_another_clock_is_said_once(self):
        outcome, saved = self.run_with("clock", "--gravity", self.samples("later.txt", later=1000))
        assert outcome.err.count("no sample near any image") == 1, outcome
        assert "1000.000 to 1014.900 s" in outcome.err
        assert "gravity measured" not in oaslam("info", saved).out
        folder = os.path.join(self.folder, "localized")
        outcome = must_run("localize", "--map", saved, *harness.clip("map_front"), "--to", 20, "--gravity", os.path.join(self.folder, "later.txt"), "--out", folder)
        assert outcome.err.count("no sample near any image") == 1, outcome

    def test_bad_files(self):
        for name, text, word in (("empty.txt", "# nothing\n", "no line"), ("short.txt", "0 0 9.81\n", "short.txt:1"), ("zero.txt", "0 0 0 0\n", "not all zero")):
            path = os.path.join(self.folder, name)
            with open(path, "w") as f:
                f.write(text)
            outcome = oaslam("run", *harness.clip("map_front"), "--out", os.path.join(self.folder, "bad"), "--gravity", path)
            assert outcome.code == 1, outcome
            assert word in outcome.err
