"""oaslam odometry: the motion of the camera without a map."""
import os
import re
import subprocess
import sys

import numpy as np

from harness import SAMPLE, InFolder, groundtruth, distances, must_run, oaslam, pairs, read_bytes, read_csv, read_json, read_tum, rmse, similarity

VIDEO, CAMERA = f"{SAMPLE}/map_front/video.mp4", f"{SAMPLE}/map_front/camera.yaml"


class TestOdometry(InFolder):
    @classmethod
    def prepare(cls):
        must_run("odometry", VIDEO, "--camera", CAMERA, "--to", "150", "--out", cls.path("poses.txt"), "--report", cls.path("report.csv"))

    def test_every_image_has_a_pose(self):
        poses = read_tum(self.path("poses.txt"))
        assert len(poses) == 150
        matched = pairs(poses, read_tum(groundtruth("map_front")))
        begun = matched[sum(row["state"] == "preliminary" for row in read_csv(self.path("report.csv"))):]
        # The way is .7 m.
        assert rmse(distances(begun, similarity(begun))) < 0.005

    def test_the_report_has_a_row_for_each_image(self):
        rows = read_csv(self.path("report.csv"))
        assert len(rows) == 150
        states = [row["state"] for row in rows]
        assert states == sorted(states), "preliminary first, then tracking"
        assert states[-1] == "tracking"
        for row in rows[1:]:
            assert int(row["inliers"]) <= int(row["tracked"]) and int(row["tracked"]) > 100, row
        assert 0 < np.median([float(row["sigma_position"]) for row in rows if row["state"] == "tracking"]) < 0.05

    def test_it_repeats_exactly(self):
        must_run("odometry", VIDEO, "--camera", CAMERA, "--to", "150", "--out", self.path("again.txt"))
        assert read_bytes(self.path("again.txt")) == read_bytes(self.path("poses.txt"))

    # What a phone's gyroscope would have measured, with its clock 30 ms ahead.
    def test_a_gyroscope_is_calibrated(self):
        imu = self.path("imu.csv")
        tool = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "tools", "simulated_gyroscope")
        subprocess.run([sys.executable, tool, groundtruth("map_front"), imu, "--offset", "0.03"], check=True)
        done = must_run("odometry", VIDEO, "--camera", CAMERA, "--imu", imu, "--out", self.path("turned.txt"))
        offset, sigma = map(float, re.search(r"clock ahead by (\S+) \(sigma (\S+)\) ms", done.err).groups())
        assert abs(offset - 30) < 4 * sigma < 20, done.err
        assert f"ms; axes taken to be the camera's, since --camera {CAMERA} does not tell others" in done.err
        matched = pairs(read_tum(self.path("turned.txt"))[100:], read_tum(groundtruth("map_front")))
        assert rmse(distances(matched, similarity(matched))) < 0.005
        # Without the samples the poses are others.
        assert read_tum(self.path("turned.txt"))[149] != read_tum(self.path("poses.txt"))[149]

        # Rates of the other direction: of axes that are left-handed.
        rows = np.loadtxt(imu, delimiter=",")
        with open(self.path("against.csv"), "w", encoding="utf-8") as file:
            file.writelines(f"{time:.0f},{-x},{-y},{-z}\n" for time, x, y, z in rows[:, :4])
        done = must_run("odometry", VIDEO, "--camera", CAMERA, "--imu", self.path("against.csv"), "--out", self.path("refused.txt"))
        assert "left-handed" in done.err and "clock ahead by" in done.err, done
        # Rates of another hand.
        rng = np.random.default_rng(1)
        with open(self.path("other.csv"), "w", encoding="utf-8") as file:
            file.writelines(f"{time:.0f},{x},{y},{z}\n" for time, (x, y, z) in zip(rows[:, 0], np.cumsum(rng.normal(0, 0.1, (len(rows), 3)), axis=0).clip(-2, 2)))
        done = must_run("odometry", VIDEO, "--camera", CAMERA, "--imu", self.path("other.csv"), "--out", self.path("refused.txt"))
        assert "gyroscope: refused at the end" in done.err and "clock ahead by" not in done.err, done
        for command in (["odometry", VIDEO, "--out", self.path("short.txt")], ["run", "--images", VIDEO, "--out", self.path("run")]):
            done = must_run(*command, "--camera", CAMERA, "--to", 4, "--imu", imu)
            assert "gyroscope: bias and clock not known at the end" in done.err and "clock ahead" not in done.err, done

    def test_an_accelerometer_tells_the_metre(self):
        imu = self.path("accelerations.csv")
        tool = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "tools", "simulated_gyroscope")
        subprocess.run([sys.executable, tool, groundtruth("map_front"), imu, "--percent", "0.5", "--accelerations"], check=True)
        done = must_run("run", "--images", VIDEO, "--camera", CAMERA, "--imu", imu, "--out", self.path("metres"), "--map-out", self.path("metres.map"))
        sensor = read_json(os.path.join(self.path("metres"), "summary.json"))["unit_by_sensor"]
        assert sensor["sensor"] == "imu" and 0 < sensor["sigma"] <= 0.06, done.err
        matched = pairs(read_tum(os.path.join(self.path("metres"), "trajectory.txt")), read_tum(groundtruth("map_front")))
        scale = similarity(matched)[0]
        assert abs(scale - 1) < 0.05, (scale, done.err)
        assert "(by the IMU)" in done.out and "accelerometer: bias" in done.err, done
        assert "(by the IMU)" in must_run("info", self.path("metres.map")).out

    def test_localize_refuses_a_gyroscope_that_it_would_not_use(self):
        for options, message in ((["--detections", "boxes.json"], "localize: --imu needs --images"), (["--images", VIDEO, "--every-frame"], "--every-frame excludes --imu")):
            done = oaslam("localize", "--map", "none.map", "--imu", "imu.csv", *options, "--out", self.path("no"))
            assert done.code != 0 and message in done.err, done

    def test_a_gyroscope_that_cannot_be_used(self):
        bad = self.path("bad.csv")
        for text, message in (("0,0,0\n", "bad.csv:1: column 4"), ("0,200,0,0\n", "200 rad/s, allowed: 0 to 100"), ("#\n", "EuRoC"),
                              ("time,ax,ay,az\n0,0,0,0\n", "no gyroscope in it"),
                              ("0,0,0,0\n1e12,0,0,0\n", "bad.csv:1: time stamps from here on: median spacing 1e+12, which is 0.0001 to 0.1 s in none of s, ms, us, ns")):
            with open(bad, "w", encoding="utf-8") as file:
                file.write(text)
            done = oaslam("odometry", VIDEO, "--camera", CAMERA, "--imu", bad, "--out", self.path("no.txt"))
            assert done.code == 1 and message in done.err and done.err.count("\n") == 1, done
        with open(bad, "w", encoding="utf-8") as file:
            file.write("1000000000000,0,0,0\n")
        done = must_run("odometry", VIDEO, "--camera", CAMERA, "--to", 5, "--imu", bad, "--out", self.path("unused.txt"))
        assert "no sample near any image: it has 1000.000 to 1000.000 s" in done.err

    def test_what_is_wrong_with_an_imu_is_said_and_the_run_goes_on(self):
        imu = self.path("phone.csv")
        with open(imu, "w", encoding="utf-8") as file:  # rates in deg/s, accelerations without gravity, a sample twice and a gap
            file.write("timestamp_ms,gx,gy,gz,ax,ay,az\n")
            for i in range(400):
                if not 100 < i < 150:
                    file.write(f"{5 * i},{20 * np.sin(i / 30)},{30 * np.cos(i / 40)},1,{np.sin(i / 9)},{np.cos(i / 7)},0.1\n" * (1 + (i == 50)))
        done = must_run("odometry", VIDEO, "--camera", CAMERA, "--to", 30, "--imu", imu, "--out", self.path("phone.txt"))
        for sentence in ("IMU: 1 of 352 samples have the time stamp of the one before", "taken as deg/s", "gravity is not in it (linear acceleration): only the gyroscope is used",
                         "1 stretch of more than 0.1 s without samples, the longest 0.25 s, at 0.500 s"):
            assert done.err.count(f"{imu}: ") == 4 and sentence in done.err, done
        assert len(read_tum(self.path("phone.txt"))) == 30

    def test_bad_input(self):
        missing = self.path("missing.mp4")
        for arguments, message in (([missing, "--camera", CAMERA], "missing.mp4"), ([VIDEO, "--camera", self.path("none.yaml")], "none.yaml"),
                                   ([VIDEO, "--camera", "fov:400"], "fov"),
                                   ([VIDEO, "--camera", "auto"], "--camera auto")):
            done = oaslam("odometry", *arguments, "--to", "5", "--out", self.path("no.txt"))
            assert done.code == 1, done
            assert message in done.err
            assert done.err.count("\n") == 1, done
