"""The odometry for browsers (web/dist/oaslam_odometry.js, docs/odometry-js.md) tells of the same images what the native one tells."""
import json
import math
import os
import platform
import shutil
import subprocess
import sys

import numpy as np
import pytest

from harness import SAMPLE, InFolder, groundtruth, must_run, pairs, read_tum, similarity

SOURCE = os.environ["OASLAM_SOURCE_DIR"]
HERE = os.path.join(SOURCE, "tests", "e2e")
VIDEO, CAMERA = f"{SAMPLE}/map_front/video.mp4", f"{SAMPLE}/map_front/camera.yaml"
OF_MODULE = {"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5}
# Of the sums of doubles only the program for x86-64 has the order of the module. The sines of the C libraries differ in their last bits everywhere.
IS_SAME_ORDER = platform.machine() == "x86_64"

pytestmark = pytest.mark.skipif(not shutil.which("node"), reason="there is no node")


class TestModule(InFolder):
    @classmethod
    def prepare(cls):
        cls.result, cls.trajectory = cls.both(np.empty((0, 4)))

    @classmethod
    def both(cls, samples):
        """What odometry_module.mjs says, with the samples of a gyroscope or an IMU given to both, and the module's trajectory."""
        np.append(samples.shape[1], samples).tofile(cls.path("samples"))
        subprocess.run([os.environ["OASLAM_ODOMETRY_ESTIMATES"], VIDEO, CAMERA, cls.path("samples"), cls.folder], check=True)
        done = subprocess.run(["node", os.path.join(HERE, "odometry_module.mjs"), os.path.join(SOURCE, "web", "dist", "oaslam_odometry.js"), json.dumps(OF_MODULE),
                               cls.path("samples"), cls.folder], capture_output=True, text=True, timeout=300)
        assert (done.returncode, done.stderr) == (0, "")
        print(done.stdout)
        return json.loads(done.stdout), read_tum(cls.path("trajectory.txt"))

    def check(self, result):
        assert result["images"] == 450
        if IS_SAME_ORDER:
            assert set(result["first"]) <= {"rotation", "translation", "covariance", "points", "metre"}, result
        assert result["px"] <= (0 if IS_SAME_ORDER else 0.1), result
        assert result["inverse_depth"] < (1e-6 if IS_SAME_ORDER else 1e-3), result
        assert result["position"] < 1e-6 and result["rotation"] < 1e-6 and result["metre"] < 1e-5, result

    def test_it_tells_what_the_command_writes(self):
        self.check(self.result)
        must_run("odometry", VIDEO, "--camera", CAMERA, "--out", self.path("command.txt"))
        native = read_tum(self.path("command.txt"))
        assert len(self.trajectory) == len(native) == 450
        for (t, p, q), (t_native, p_native, q_native) in zip(self.trajectory, native):
            assert abs(t - t_native) < 1e-6 and math.dist(p, p_native) < 2e-6
            assert min(math.dist(q, q_native), math.dist(q, [-x for x in q_native])) < 2e-6

    def test_key_points(self):
        features = self.result["features"]
        assert features["images"] == 9 and features["count"] > 5000
        assert features["different"] == 0 and features["angle"] < 1e-6, features

    def test_a_gyroscope(self):
        result, trajectory = self.both(self.simulated("--offset", "0.03"))
        self.check(result)
        assert trajectory[-1] != self.trajectory[-1] and result["told"]["images"] == 0

    def simulated(self, *options):
        imu = self.path("imu.csv")
        subprocess.run([sys.executable, os.path.join(SOURCE, "tools", "simulated_gyroscope"), groundtruth("map_front"), imu, *options], check=True)
        samples = np.loadtxt(imu, delimiter=",")
        samples[:, 0] *= 1e-9
        return samples

    def test_an_accelerometer_tells_the_metre(self):
        result, trajectory = self.both(self.simulated("--percent", "0.5", "--accelerations"))
        self.check(result)
        told = result["told"]
        assert told["images"] > 200 and 0 < told["sigma"] < 0.1, told
        matched = pairs(trajectory[100:], read_tum(groundtruth("map_front")))
        scale = similarity(matched)[0]
        assert abs(told["metres"] / scale - 1) < 0.05, (told, scale)
        assert abs(math.hypot(*told["gravity"]) - 9.81) < 0.1 and told["gravity"][1] > 5, told  # down is y in an upright image
