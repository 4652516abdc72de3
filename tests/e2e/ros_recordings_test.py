"""Recordings of ROS as inputs: an MCAP file with depths, an IMU and detections, and the recordings of others' writers."""
import os
import sqlite3
import struct

import numpy as np
import pytest

from depth_test import COUNT, FOCAL, HEIGHT, STEP, WIDTH, scene
from harness import InFolder, must_run, oaslam, read_csv, read_tum
from ros_writer import Cdr, START, write_mcap

RATE = 30
ROBOTS = os.path.join(os.environ.get("OASLAM_DATA", "/nonexistent"), "..", "robots")


def robot(depth_frame, encoding):
    messages = [(0, "/tf_static", "tf2_msgs/TFMessage", Cdr(None, "").transform("base", "camera")),
                (0, "/tf_static", "tf2_msgs/TFMessage", Cdr(None, "").transform("base", "imu")),
                (0, "/tf_static", "tf2_msgs/TFMessage", Cdr(None, "").transform("camera", "depth"))]
    for i, (image, depth, box) in enumerate(scene()):
        t = i / RATE
        counts = (depth[::2, ::2] * 1000).astype(np.uint16) if encoding == "16UC1" else depth[::2, ::2].astype(np.float32)
        messages += [(t + 0.005, "/camera/image_raw", "sensor_msgs/Image", Cdr(t, "camera").image(image.astype(np.uint8), "mono8")),
                     (t + 0.004, "/camera/camera_info", "sensor_msgs/CameraInfo", Cdr(t, "camera").camera_info(WIDTH, HEIGHT, FOCAL)),
                     (t + 0.009, "/depth/image_rect_raw", "sensor_msgs/Image", Cdr(t + 0.004, depth_frame).image(counts, encoding)),
                     (t + 0.006, "/depth/camera_info", "sensor_msgs/CameraInfo", Cdr(t, depth_frame).camera_info(WIDTH // 2, HEIGHT // 2, FOCAL / 2)),
                     (t + 0.2, "/detections", "vision_msgs/Detection2DArray", Cdr(t, "camera").detections(t, box, "chair"))]
        messages += [(t + k / 240, "/imu", "sensor_msgs/Imu", Cdr(t + k / 240, "imu").imu()) for k in range(8)]
    return messages


class TestRobot(InFolder):
    @classmethod
    def prepare(cls):
        for name, frame, encoding in (("registered", "camera", "16UC1"), ("own", "depth", "32FC1")):
            write_mcap(cls.path(f"{name}.mcap"), robot(frame, encoding))

    def test_camera_depths_and_imu_are_taken(self):
        for name in ("registered", "own"):
            out = self.path(f"{name}.txt")
            done = must_run("odometry", self.path(f"{name}.mcap"), "--out", out, "--report", self.path(f"{name}.csv"))
            for part in (f"{COUNT} images of /camera/image_raw", "camera /camera/camera_info", "IMU /imu", "depths of /depth/image_rect_raw"):
                assert part in done.err, (part, done)
            poses, rows = read_tum(out), read_csv(self.path(f"{name}.csv"))
            assert abs(np.linalg.norm(np.subtract(poses[-1][1], poses[0][1])) / (STEP * (COUNT - 1)) - 1) < 0.02, (name, done)
            assert abs(poses[1][0] - (START + 1 / RATE)) < 1e-5 and float(rows[0]["metres_per_unit"]) == 1

    def test_detections_are_taken_unless_a_detector_is_asked_for(self):
        done = must_run("run", "--images", self.path("registered.mcap"), "--out", self.path("boxes"), "--map-out", self.path("boxes.map"))
        assert "detections of /detections" in done.err and "1 objects" in done.out, done
        assert all(row["detections"] == "1" for row in read_csv(self.path("boxes/frames.csv")))
        done = must_run("localize", "--images", self.path("own.mcap"), "--map", self.path("boxes.map"), "--out", self.path("localized"))
        assert f"{COUNT} of {COUNT} images localized" in done.out and "detections of /detections" in done.err, done
        done = must_run("run", "--images", self.path("registered.mcap"), "--detector", "none", "--out", self.path("none"))
        assert "0 objects" in done.out, done

    def test_the_images_alone(self):
        done = oaslam("odometry", self.path("own.mcap"), "--dataset", "none", "--out", self.path("alone.txt"))
        assert done.code == 1 and "--camera" in done.err, done

    def test_what_is_asked_for_and_not_there_is_refused(self):
        for options, what in ((("--topic", "/rear"), "--topic /rear: is not there; it has"), (("--depth", "/camera/image_raw"), "allowed: 16UC1, 32FC1"),
                              (("--topic", "/depth/image_rect_raw"), "which --depth takes"), (("--time-unit", "ns"), "--time-unit")):
            done = oaslam("odometry", self.path("own.mcap"), *options, "--out", self.path("no.txt"))
            assert done.code == 1 and what in done.err and not os.path.exists(self.path("no.txt")), done

    def test_info_lists_the_topics(self):
        done = must_run("info", self.path("own.mcap"))
        assert "/depth/image_rect_raw: sensor_msgs/Image 32FC1 160 x 120, 40 messages, 30.0 Hz" in done.out and "oaslam takes 40 images" in done.out, done


@pytest.mark.skipif(not os.path.isdir(ROBOTS), reason="needs robots beside OASLAM_DATA")
class TestSamples(InFolder):
    def test_every_container_gives_the_poses_of_the_images(self):
        lines = []
        database = sqlite3.connect(f"file:{ROBOTS}/ros2/sample/sample_0.db3?immutable=1", uri=True)
        for (data,) in database.execute("SELECT data FROM messages JOIN topics ON topics.id = topic_id WHERE name LIKE '%compressed' ORDER BY messages.id"):
            at, (second, nanosecond) = data.index(b"\xff\xd8\xff"), struct.unpack_from("<iI", data, 4)
            with open(self.path(f"{len(lines):03}.jpg"), "wb") as file:
                file.write(data[at:at + struct.unpack_from("<I", data, at - 4)[0]])
            lines.append(f"{second}.{nanosecond:09} {len(lines):03}.jpg\n")
        with open(self.path("list.txt"), "w", encoding="utf-8") as file:
            file.writelines(lines)
        with open(self.path("camera.yaml"), "w", encoding="utf-8") as file:
            file.write("image_width: 320\nimage_height: 240\ncamera_matrix: {rows: 3, cols: 3, data: [262.5, 0, 159.5, 0, 262.5, 119.5, 0, 0, 1]}\n"
                       "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n")
        must_run("run", "--images", self.path("list.txt"), "--camera", self.path("camera.yaml"), "--out", self.path("images"))
        with open(self.path("images/trajectory.txt"), encoding="utf-8") as file:
            expected = file.read()
        assert expected.count("\n") == 90
        for sample in ("bags/sample.bag", "ros2/sample.mcap", "ros2/sample"):
            must_run("run", "--images", f"{ROBOTS}/{sample}", "--out", self.path("out"))
            with open(self.path("out/trajectory.txt"), encoding="utf-8") as file:
                assert file.read() == expected, sample
