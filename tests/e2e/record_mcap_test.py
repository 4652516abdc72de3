"""--record FILE.mcap and `export --format mcap`: results as messages of ROS 2, read by our reader and by others', and what cannot be written."""
import ctypes
import json
import os
import shutil
import signal
import struct
import subprocess
import time

import harness
import numpy as np
import pytest
from harness import must_run, oaslam
from model_readers import NODE_MODULES

COUNT = 120
ROBOTS = os.path.join(os.environ.get("OASLAM_DATA", "/nonexistent"), "..", "robots")
HERE = os.path.dirname(os.path.abspath(__file__))
TOPICS = {"/tf": "tf2_msgs/TFMessage", "/oaslam/pose": "geometry_msgs/PoseWithCovarianceStamped", "/oaslam/path": "nav_msgs/Path",
          "/oaslam/landmarks": "sensor_msgs/PointCloud2", "/oaslam/objects": "visualization_msgs/MarkerArray",
          "/oaslam/objects_3d": "vision_msgs/Detection3DArray", "/oaslam/image/compressed": "sensor_msgs/CompressedImage",
          "/oaslam/camera_info": "sensor_msgs/CameraInfo", "/oaslam/detections": "vision_msgs/Detection2DArray", "/oaslam/events": "rcl_interfaces/Log"}


def read_by_others(path):
    if not shutil.which("node") or not os.path.isdir(os.path.join(NODE_MODULES, "@mcap", "core")):
        pytest.skip("no readers of MCAP: needs node and npm ci in tests/e2e")
    done = subprocess.run(["node", os.path.join(HERE, "mcap_check.mjs"), path], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done
    return json.loads(done.stdout)


def events(path):
    """The texts of /oaslam/events."""
    zstd = ctypes.CDLL("libzstd.so.1")
    zstd.ZSTD_decompress.restype = ctypes.c_size_t

    def records(data):
        at = 0
        while at < len(data):
            kind, length = struct.unpack_from("<BQ", data, at)
            yield kind, data[at + 9:at + 9 + length]
            at += 9 + length

    def text(data, at):
        at += -(at - 4) % 4  # from the beginning of the message
        length, = struct.unpack_from("<I", data, at)
        return data[at + 4:at + 4 + length].rstrip(b"\0").decode(), at + 4 + length

    channel, texts = None, []
    for kind, chunk in records(harness.read_bytes(path)[8:-8]):
        if kind != 6:
            continue
        size, = struct.unpack_from("<Q", chunk, 16)
        packed = chunk[28 + 4 + len("zstd") + 8:]
        plain = ctypes.create_string_buffer(size)
        assert zstd.ZSTD_decompress(plain, ctypes.c_size_t(size), packed, ctypes.c_size_t(len(packed))) == size
        for kind, record in records(plain.raw):
            if kind == 4 and b"/oaslam/events" in record:
                channel = record[:2]
            elif kind == 5 and record[:2] == channel:
                message = record[22:]
                _, at = text(message, 4 + 4 + 4 + 1)  # behind stamp and level: name, then msg
                texts.append(text(message, at)[0])
    return texts


def position(value):
    return np.array([value["x"], value["y"], value["z"]])


class TestRecordMcap(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.map, cls.file = cls.path("desk.map"), cls.path("desk.mcap")
        cls.clip = [*harness.clip("map_front"), "--to", COUNT]
        must_run("run", *cls.clip, "--out", cls.path("recorded"), "--map-out", cls.map, "--record", cls.file)

    def test_our_reader_lists_it(self):
        done = must_run("info", self.file)
        assert "/oaslam/image/compressed: sensor_msgs/CompressedImage jpeg" in done.out, done
        for topic, kind in TOPICS.items():
            assert f"{topic}: {kind}" in done.out, (topic, done)

    def test_the_results_are_the_same(self):
        must_run("run", *self.clip, "--out", self.path("plain"), "--map-out", self.path("plain.map"))
        assert harness.read_bytes(self.path("plain.map")) == harness.read_bytes(self.map)

    def test_others_read_the_run(self):
        topics = read_by_others(self.file)
        assert {name: topic["type"].replace("/msg/", "/") for name, topic in topics.items()} == TOPICS
        live = harness.read_tum(self.path("recorded/trajectory_live.txt"))
        assert topics["/oaslam/image/compressed"]["count"] == topics["/oaslam/camera_info"]["count"] == COUNT
        assert topics["/tf"]["count"] == topics["/oaslam/pose"]["count"] >= len(live) > COUNT / 2
        pose, transform = topics["/oaslam/pose"]["last"], topics["/tf"]["last"]["transforms"][0]
        assert transform["header"]["frame_id"] == "map" and transform["child_frame_id"] == "camera_optical_frame"
        stamp = pose["header"]["stamp"]
        assert abs(stamp["sec"] + stamp.get("nanosec", stamp.get("nsec")) * 1e-9 - live[-1][0]) < 1e-5
        covariance = np.array(pose["pose"]["covariance"]).reshape(6, 6)
        assert np.all(np.linalg.eigvalsh(covariance) > 0) and np.allclose(covariance, covariance.T)
        # The desk is below the camera, which looks at it.
        spheres = [m for m in topics["/oaslam/objects"]["last"]["markers"] if m["type"] == 2 and m["action"] == 0]
        assert len(spheres) == len(topics["/oaslam/objects_3d"]["last"]["detections"]) > 3
        assert np.mean([position(m["pose"]["position"])[2] for m in spheres]) < position(pose["pose"]["pose"]["position"])[2]
        assert {"laptop", "cup", "keyboard", "book"} & {d["results"][0]["hypothesis"]["class_id"] for d in topics["/oaslam/objects_3d"]["last"]["detections"]}

    def test_others_read_a_saved_map(self):
        path = self.path("export.mcap")
        must_run("export", "--map", self.map, "--format", "mcap", "--out", path)
        topics = read_by_others(path)
        poses = harness.read_tum(self.path("recorded/trajectory.txt"))
        assert topics["/tf"]["count"] == len(topics["/oaslam/path"]["last"]["poses"]) == len(poses)
        # Distances are those of the map.
        ways = [np.linalg.norm(np.subtract(end, begin)) for begin, end in (
            (poses[0][1], poses[-1][1]), [position(topics["/oaslam/path"]["last"]["poses"][i]["pose"]["position"]) for i in (0, -1)])]
        assert abs(ways[0] - ways[1]) < 1e-6 * ways[0]

    def test_localize(self):
        for options in ((), ("--every-frame",)):
            path = self.path("localized.mcap")
            must_run("localize", "--map", self.map, *harness.clip("map_front"), "--from", 40, "--to", 60, "--out", self.path("localized"), "--record", path, *options)
            out = must_run("info", path).out
            assert "/oaslam/pose: geometry_msgs/PoseWithCovarianceStamped, 20 messages" in out, out

    def test_events_are_those_of_the_slam(self):
        """A camera that is dark twice: a submap begins, and what the run says of joinings and loops is recorded, and no other."""
        subprocess.run(["ffmpeg", "-v", "error", "-i", harness.clip("map_front")[1], "-q:v", "2", self.path("%04d.jpg")], check=True)
        subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", "color=black:s=640x480", "-frames:v", "1", self.path("dark.jpg")], check=True)
        names = [*range(1, 90), *["dark"] * 20, *range(150, 300), *range(90, 1, -2)]
        with open(self.path("list.txt"), "w", encoding="utf-8") as file:
            file.writelines(f"{i / 10} {name if name == 'dark' else f'{name:04}'}.jpg\n" for i, name in enumerate(names))
        path = self.path("dark.mcap")
        done = must_run("run", self.path("list.txt"), *harness.clip("map_front")[2:4], "--detector", "none", "--out", self.path("dark"), "--record", path)
        texts = events(path)
        assert texts[0] == "preliminary" and texts.count("lost") == 2, texts
        assert sum(text.startswith("a submap grows: world ") for text in texts) > 0, texts
        for said, recorded in ((", was joined: ", "was joined with the map"), ("loop closed", "a loop was closed")):
            assert sum(recorded in text for text in texts) == done.err.count(said), (texts, done)

    def test_it_is_an_input_too(self):
        if os.path.isdir(ROBOTS):
            shutil.copytree(os.path.join(ROBOTS, "ros2", "sample"), self.path("bag"))
        for images, path in ((self.file, self.file), (self.path("bag"), self.path("bag/new.mcap"))):
            if os.path.exists(images):
                done = oaslam("run", "--images", images, "--out", self.path("again"), "--record", path)
                assert done.code == 1 and "would change" in done.err and not os.path.exists(self.path("bag/new.mcap")), done
        assert "120 messages" in must_run("info", self.file).out

    def test_a_run_that_is_killed(self):
        path = self.path("killed.mcap")
        process = subprocess.Popen([harness.BINARY, "run", *harness.clip("map_front"), "--out", self.path("killed"), "--record", path],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and not (os.path.exists(path) and os.path.getsize(path) > 1 << 20):
            time.sleep(0.01)
        assert process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        done = must_run("info", path)
        assert "ends early" in done.err and "/oaslam/pose" in done.out, done

    def test_what_cannot_be_written(self):
        for path, words in (("/nowhere/a.mcap", "/nowhere/a.mcap: cannot be written: No such file"), (self.path("a.avi"), "allowed: .mp4, .mcap")):
            done = oaslam("run", *self.clip, "--out", self.path("bad"), "--record", path)
            assert done.code == 1 and words in done.err and not os.path.exists(self.path("bad")), done
        os.symlink("/dev/full", self.path("full.mcap"))
        done = oaslam("run", *self.clip, "--out", self.path("full"), "--map-out", self.path("full.map"), "--record", self.path("full.mcap"))
        assert done.code == 1 and done.err.count("full.mcap: cannot be written: No space left on device") == 1, done
        assert harness.read_bytes(self.path("full.map")) == harness.read_bytes(self.map)
