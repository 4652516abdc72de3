"""Folders in the layouts of datasets and recorders are taken by themselves: images, times, camera, gyroscope and truth."""
import json
import os
import re
import shutil
import subprocess
import sys

import harness
import numpy as np
import pytest
from harness import must_run, oaslam

CLIP = os.path.join(harness.SAMPLE, "map_front")
COUNT = 150  # images
START_NS = 1_403_636_579_000_000_000
INTRINSICS = (525.0, 525.0, 319.5, 239.5)


def ate(text):
    return float(re.search(r"ATE position\s+(\S+)", text)[1])


class TestDatasets(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.images = cls.path("images")
        os.mkdir(cls.images)
        subprocess.run(["ffmpeg", "-v", "error", "-i", f"{CLIP}/video.mp4", "-frames:v", str(COUNT), "-q:v", "2", f"{cls.images}/%06d.jpg"], check=True)
        cls.names = sorted(os.listdir(cls.images))
        cls.truth = harness.read_tum(harness.groundtruth("map_front"))[:COUNT]

    def write(self, name, text):
        path = self.path(name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w") as f:
            f.write(text)
        return path

    def link(self, name_of):
        """The images under other names: `name_of` makes them of their numbers."""
        for i, name in enumerate(self.names):
            path = self.path(name_of(i))
            os.makedirs(os.path.dirname(path), exist_ok=True)
            if not os.path.exists(path):
                os.link(f"{self.images}/{name}", path)

    def matrix(self, i):
        m = np.eye(4)
        m[:3, :3], m[:3, 3] = harness.rotation(self.truth[i][2]), self.truth[i][1]
        return m

    def kitti(self, name):
        self.link(lambda i: f"{name}/image_0/{i:06d}.jpg")
        fx, fy, cx, cy = INTRINSICS
        self.write(f"{name}/calib.txt", "".join(f"P{k}: {fx} 0 {cx} 0 0 {fy} {cy} 0 0 0 1 0\n" for k in range(2)))
        # A camera of another rate than the one that is taken where there are no times.
        self.write(f"{name}/times.txt", "".join(f"{i / 15:.6e}\n" for i in range(COUNT)))
        self.write(f"{name}/poses.txt", "".join(" ".join(map(str, self.matrix(i)[:3].ravel())) + "\n" for i in range(COUNT)))
        return self.path(name)

    def test_kitti_is_run_and_evaluated(self):
        folder, out = self.kitti("kitti/07"), self.path("kitti_out")
        done = must_run("run", "--images", folder, "--out", out)
        assert f"{folder}: taken for KITTI (--dataset): {COUNT} images, camera {folder}/calib.txt, {COUNT} true poses" in done.err, done
        assert "estimating its focal length" not in done.err
        frames = harness.read_csv(f"{out}/frames.csv")
        assert float(frames[-1]["timestamp"]) == pytest.approx((COUNT - 1) / 15, abs=1e-5)
        assert harness.read_json(f"{out}/summary.json")["ate"] < 0.03
        evaluated = must_run("evaluate", "trajectory", f"{out}/trajectory.txt", folder)
        assert ate(evaluated.out) < 0.03, evaluated
        # The rate that is given counts for both.
        out = self.path("kitti_fps")
        must_run("run", "--images", folder, "--fps", 30, "--to", 100, "--out", out, "--quiet")
        assert float(harness.read_csv(f"{out}/frames.csv")[-1]["timestamp"]) == pytest.approx(99 / 30, abs=1e-5)
        assert ate(must_run("evaluate", "trajectory", f"{out}/trajectory.txt", folder, "--fps", 30).out) < 0.03

    def test_what_is_given_wins(self):
        folder = self.kitti("kitti/07")
        camera = self.write("other.txt", "520 520 319.5 239.5\n")
        done = must_run("run", "--images", folder, "--camera", camera, "--groundtruth", harness.groundtruth("map_front"), "--to", 5, "--out", self.path("given"))
        assert "calib.txt" not in done.err and "true poses" not in done.err, done
        with open(self.path("given/camera.yaml")) as f:
            assert "520" in f.read()
        images = f"{folder}/image_0"
        done = must_run("odometry", images, "--dataset", "none", "--camera", camera, "--to", 5, "--out", self.path("none.txt"))
        assert "taken for" not in done.err

    def gyroscope(self):
        """Texts of time in ns and rad/s about the camera's axes."""
        imu = self.path("imu.csv")
        tool = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "tools", "simulated_gyroscope")
        subprocess.run([sys.executable, tool, harness.groundtruth("map_front"), imu], check=True)
        with open(imu) as f:
            return [line.rstrip("\n").split(",") for line in f if not line.startswith("#")]

    def test_euroc_has_a_gyroscope(self):
        root = "euroc/mav0"
        self.link(lambda i: f"{root}/cam0/data/{START_NS + i * 10**9 // 30}.jpg")
        self.write(f"{root}/cam0/data.csv", "#timestamp [ns],filename\n" + "".join(f"{START_NS + i * 10**9 // 30},{START_NS + i * 10**9 // 30}.jpg\n" for i in range(COUNT)))
        identity = ", ".join(map(str, np.eye(4).ravel()))
        self.write(f"{root}/cam0/sensor.yaml", f"sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{identity}]\nresolution: [640, 480]\n"
                   f"camera_model: pinhole\nintrinsics: [525, 525, 319.5, 239.5]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n")
        self.write(f"{root}/state_groundtruth_estimate0/data.csv", "#timestamp [ns],p_x,p_y,p_z,q_w,q_x,q_y,q_z\n" + "".join(
            f"{START_NS + i * 10**9 // 30},{','.join(map(str, [*p, q[3], *q[:3]]))}\n" for i, (_, p, q) in enumerate(self.truth)))
        lines = self.gyroscope()
        self.write(f"{root}/imu0/data.csv", "#timestamp [ns],w_x,w_y,w_z\n" + "".join(",".join([str(START_NS + int(v[0])), *v[1:]]) + "\n" for v in lines))
        folder, out = self.path("euroc"), self.path("euroc.txt")
        done = must_run("odometry", folder, "--out", out)
        assert f"taken for EuRoC (--dataset): {COUNT} images, camera {folder}/mav0/cam0/sensor.yaml, IMU {folder}/mav0/imu0/data.csv" in done.err, done
        assert "axes turned to the camera's" in done.err
        assert ate(must_run("evaluate", "trajectory", out, folder).out) < 0.1
        assert harness.read_tum(out)[0][0] == pytest.approx(START_NS / 1e9, abs=1)

    def test_recorders_of_phones(self):
        fx, fy, cx, cy = INTRINSICS
        os.makedirs(self.path("stray"), exist_ok=True)
        shutil.copy(f"{CLIP}/video.mp4", self.path("stray/rgb.mp4"))
        self.write("stray/camera_matrix.csv", f"{fx}, 0.0, {cx}\n0.0, {fy}, {cy}\n0.0, 0.0, 1.0\n")
        self.write("stray/odometry.csv", "timestamp, frame, x, y, z, qx, qy, qz, qw\n" + "".join(
            f"{900 + t}, {i:06d}, {', '.join(map(str, [*p, *q]))}\n" for i, (t, p, q) in enumerate(self.truth)))
        # The phone's x is the camera's -y, its y the camera's -x. Without gravity the accelerations are not used.
        self.write("stray/imu.csv", "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n" + "".join(
            f"{900 + int(t) / 1e9}, 0.0, {i % 7 / 100}, 0.0, {-float(y)}, {-float(x)}, {-float(z)}\n" for i, (t, x, y, z) in enumerate(self.gyroscope())))
        self.link(lambda i: f"r3d/rgbd/{i}.jpg")
        flip = np.diag([1, -1, -1])
        poses = []
        for _, p, q in self.truth:  # x y z w times half a turn about x
            x, y, z, w = q
            turned = (w, z, -y, -x)
            assert np.allclose(harness.rotation(turned), harness.rotation(q) @ flip)
            poses.append([*turned, *p])
        self.write("r3d/metadata", json.dumps({"w": 640, "h": 480, "fps": 30, "K": [fx, 0, 0, 0, fy, 0, cx, cy, 1], "poses": poses}))
        for name, layout, what in (("stray", "Stray-Scanner", "images of "), ("r3d", "Record3D", f"{COUNT} images")):
            folder, out = self.path(name), self.path(f"{name}_out")
            done = must_run("run", "--images", folder, "--to", COUNT, "--out", out)
            assert f"taken for {layout} (--dataset): {what}" in done.err and f", {COUNT} true poses" in done.err, done
            assert "estimating its focal length" not in done.err
            if name == "stray":
                assert f", IMU {folder}/imu.csv" in done.err and "axes turned to the camera's as those of its recorder" in done.err, done
                assert "gravity is not in it" in done.err and "refused" not in done.err, done
            assert ate(must_run("evaluate", "trajectory", f"{out}/trajectory.txt", folder).out) < 0.03
        # An IMU that nobody asked for does not end the run.
        self.write("stray/imu.csv", "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n0, 1, 2, 3, 4, x, 6\n")
        command = ["odometry", self.path("stray"), "--to", 4, "--out", self.path("short.txt")]
        assert "imu.csv:2: column 6: expected a number (the IMU of the dataset, left out)" in must_run(*command).err
        done = oaslam(*command, "--imu", self.path("stray/imu.csv"))
        assert done.code == 1 and "imu.csv:2: column 6" in done.err, done

    def test_apps_with_a_file_for_each_image(self):
        fx, fy, cx, cy = INTRINSICS
        flip = np.diag([1, -1, -1, 1])
        self.link(lambda i: f"scanner/frame_{i:05d}.jpg")
        for i in range(COUNT):  # nothing was measured
            self.write(f"scanner/depth_{i:05d}.png", "P5\n64 48\n65535\n" + "\0" * (2 * 64 * 48))
        self.link(lambda i: f"poly/keyframes/images/{170_000_000_000 + i * 33_333}.jpg")
        for i in range(COUNT):
            pose = self.matrix(i) @ flip
            self.write(f"scanner/frame_{i:05d}.json", json.dumps({"cameraPoseARFrame": list(pose.ravel()), "intrinsics": [fx, 0, cx, 0, fy, cy, 0, 0, 1], "time": 5000 + i / 30}))
            self.write(f"poly/keyframes/cameras/{170_000_000_000 + i * 33_333}.json", json.dumps(
                {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": 640, "height": 480} | {f"t_{r}{c}": pose[r, c] for r in range(3) for c in range(4)}))
        for name, layout, start in (("scanner", "3D-Scanner-App", 5000), ("poly", "Polycam", 170_000)):
            folder, out = self.path(name), self.path(f"{name}_out")
            done = must_run("run", "--images", folder, "--to", 100, "--out", out)
            assert f"taken for {layout} (--dataset): {COUNT} images, camera {folder}/" in done.err and f"{COUNT} true poses" in done.err, done
            assert float(harness.read_csv(f"{out}/frames.csv")[0]["timestamp"]) == pytest.approx(start)
            assert ate(must_run("evaluate", "trajectory", f"{out}/trajectory.txt", folder).out) < 0.03

    def test_a_clock_that_is_set_back(self):
        times = [1000 + i / 30 - (10 if i >= 60 else 0) for i in range(120)]
        source = self.write("back.txt", "".join(f"{t:.6f} images/{name}\n" for t, name in zip(times, self.names)))
        done = must_run("run", "--images", source, "--out", self.path("back_out"))
        assert done.err.count("back.txt:61: ") == 1 and "skipped" not in done.err, done
        frames = harness.read_csv(self.path("back_out/frames.csv"))
        assert len(frames) == 120 and float(frames[-1]["timestamp"]) == pytest.approx(1000 + 119 / 30, abs=1e-4)

    def test_boxes_of_yolo_are_pixels_of_the_images(self):
        boxes = harness.read_json(harness.clip("map_front")[5])
        for image in boxes[:COUNT]:
            lines = []
            for d in image["detections"]:
                x1, y1, x2, y2 = d["bbox"]
                lines.append(f"{d['category_id']} {(x1 + x2) / 1280} {(y1 + y2) / 960} {(x2 - x1) / 640} {(y2 - y1) / 480} {d['detection_score']}\n")
            # As a detector names those of a film, which it counts from 1; the last image has none.
            if int(image["file_name"].split(".")[0]) < COUNT - 1:
                self.write(f"yolo/labels/video_{int(image['file_name'].split('.')[0]) + 1}.txt", "".join(lines))
        camera, video = harness.clip("map_front")[3], harness.clip("map_front")[1]
        for name, detections in (("own", harness.clip("map_front")[5]), ("shares", self.path("yolo"))):
            must_run("run", "--images", video, "--camera", camera, "--detections", detections, "--to", COUNT, "--out", self.path(name), "--quiet")
        counts = [[f["detections"] for f in harness.read_csv(self.path(f"{name}/frames.csv"))][:COUNT - 1] for name in ("own", "shares")]
        assert counts[0] == counts[1] and len(set(counts[0])) > 1
        own, shares = (harness.read_json(self.path(f"{name}/objects.json")) for name in ("own", "shares"))
        assert len(own) == len(shares) > 2
        for a, b in zip(own, shares):
            assert a["category"] == b["category"] and a["center"] == pytest.approx(b["center"], abs=0.02)

    def test_what_is_wrong_is_named(self):
        broken = self.kitti("broken")
        self.write("broken/times.txt", "0\n0.1\n")
        for args, words in (
                (["run", "--images", broken, "--out", self.path("no")], [f"{broken}/times.txt: 2 times", f"{COUNT} images", "--dataset none"]),
                (["run", "--images", self.images, "--dataset", "euroc", "--out", self.path("no")], [self.images, "--dataset euroc"]),
                (["run", "--images", self.images, "--dataset", "kiti", "--out", self.path("no")], ["--dataset kiti", "KITTI", "none"]),
                (["odometry", self.images, "--out", self.path("no.txt")], ["--camera", "calibration"]),
                (["evaluate", "trajectory", harness.groundtruth("map_front"), self.images], [self.images, "no known layout"])):
            outcome = oaslam(*args)
            assert outcome.code == 1, outcome
            for word in words:
                assert word in outcome.err, outcome
        # An empty one.
        self.write("empty/mav0/cam0/data.csv", "#timestamp [ns],filename\n")
        outcome = oaslam("run", "--images", self.path("empty"), "--out", self.path("no"))
        assert outcome.code == 1 and "EuRoC, but no images" in outcome.err, outcome
