"""oaslam-ros2 among other nodes, by CycloneDDS and by Fast DDS: what it publishes and when, what it says where something is missing, and what it saves."""
import contextlib
import os
import signal
import struct
import subprocess
import time

import harness
import numpy as np
import pytest
from harness import must_run
from ros_writer import START, Cdr, write_mcap

BUILD = os.environ["OASLAM_BUILD_DIR"]
NODE, PEER, FAST_PEER = (os.path.join(BUILD, name) for name in ("oaslam-ros2", "ros2/ros2_peer", "ros2/fastdds_peer"))
COUNT = 120  # images
TOPICS = {"/tf": "tf2_msgs/TFMessage", "/oaslam/pose": "geometry_msgs/PoseWithCovarianceStamped", "/oaslam/odometry": "nav_msgs/Odometry",
          "/oaslam/path": "nav_msgs/Path", "/oaslam/objects": "visualization_msgs/MarkerArray", "/oaslam/objects_3d": "vision_msgs/Detection3DArray",
          "/oaslam/status": "diagnostic_msgs/DiagnosticArray"}
# This machine alone, and domains that other tests at the same time do not have.
LOOPBACK = """<General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><Peers><Peer address="127.0.0.1"/></Peers><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>9</MaxAutoParticipantIndex></Discovery>"""
domains = iter((os.getpid() + 17 * i) % 100 + 1 for i in range(100))


class Reader:
    """The values of a message in CDR."""
    def __init__(self, data):
        self.data, self.at = data[4:], 0

    def get(self, kind, count=1):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        values = struct.unpack_from("<" + kind * count, self.data, self.at)
        self.at += size * count
        return values if count > 1 else values[0]

    def text(self):
        length = self.get("I")
        self.at += length
        return self.data[self.at - length:self.at - 1].decode()

    def stamp(self):
        return self.get("i") * 10**9 + self.get("I")

    def pose(self):
        """Position, and rotation matrix."""
        *position, x, y, z, w = self.get("d", 7)
        rotation = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, position
        return matrix


def stamped_pose(data):
    reader = Reader(data)
    return reader.stamp(), reader.text(), reader.pose()


def transform(data):
    reader = Reader(data)
    assert reader.get("I") == 1
    return reader.stamp(), reader.text(), reader.text(), reader.pose()


def status_text(data):
    reader = Reader(data)
    reader.stamp(), reader.text(), reader.get("I")
    return reader.get("B"), reader.text(), reader.text()


class Robot:
    """Other nodes, and the program, in one domain."""
    def __init__(self, folder):
        self.folder, self.running = folder, []
        self.environment = {**os.environ, "ROS_DOMAIN_ID": str(next(domains)), "CYCLONEDDS_URI": f"<CycloneDDS><Domain Id=\"any\">{LOOPBACK}</Domain></CycloneDDS>"}

    def start(self, name, *command):
        out, err = (open(os.path.join(self.folder, f"{name}.{end}"), "wb") for end in ("out", "err"))
        self.running.append(subprocess.Popen([*map(str, command)], env=self.environment, stdout=out, stderr=err))
        return self.running[-1]

    def text(self, name):
        with open(os.path.join(self.folder, f"{name}.err")) as file:
            return file.read()

    def heard(self, name):
        """{topic: messages}"""
        messages = {topic: [] for topic in TOPICS}
        with open(os.path.join(self.folder, f"{name}.out")) as file:
            for line in file:
                if line.endswith("\n"):
                    topic, _, data = line.split()
                    messages[topic].append(bytes.fromhex(data))
        return messages

    def listen(self, name, seconds, peer=PEER, topics=TOPICS):
        return self.start(name, peer, "listen", seconds, *(f"{topic}={kind}" for topic, kind in topics.items()))

    def wait_for(self, condition, seconds=60):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, {name: self.text(name)[-2000:] for name in ("node",)}
            time.sleep(0.1)

    def stop(self, process):
        process.send_signal(signal.SIGINT)
        return process.wait(60)

    def end(self):
        for process in self.running:
            if process.poll() is None:
                process.kill()
            process.wait()


@contextlib.contextmanager
def robot(folder, name):
    path = os.path.join(folder, name)
    os.makedirs(path)
    one = Robot(path)
    try:
        yield one
    finally:
        one.end()


def stamp_of(second):
    return (START + int(second)) * 10**9 + round(second % 1 * 1e9)


def odom_at(second):
    return np.array([0.1 * second, 0, 0])


def record(path, count=COUNT, stamp=lambda second: second):
    video = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", video, "-frames:v", str(count), "-pix_fmt", "gray", "-f", "rawvideo", "-"], capture_output=True, check=True).stdout
    images = np.frombuffer(raw, np.uint8).reshape(count, 480, 640)
    static = Cdr(None, None).put("I", 1, 0, 0).text("base_link").text("camera").put("d", 0.1, 0, 0.5, -.5, .5, -.5, .5)
    messages = [(0, "/tf_static", "tf2_msgs/TFMessage", static)]
    for i, image in enumerate(images):
        second = 1 + i / 30
        messages.append((second, "/camera/camera_info", "sensor_msgs/CameraInfo", Cdr(second, "camera").camera_info(640, 480, 525.0)))
        messages.append((second, "/camera/image_raw", "sensor_msgs/Image", Cdr(stamp(second), "camera").image(image, "mono8")))
    for i in range(50 * (count // 30 + 2)):
        second = i / 50
        moving = Cdr(None, None).put("I", 1, START + int(second), round(second % 1 * 1e9)).text("odom").text("base_link")
        messages.append((second + 0.015, "/tf", "tf2_msgs/TFMessage", moving.put("d", *odom_at(second), 0, 0, 0, 1)))
    write_mcap(path, messages)


class TestRobot(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.recording, cls.metric = cls.path("drive.mcap"), cls.path("metric.map")
        record(cls.recording)
        cls.stamps = [stamp_of(1 + i / 30) for i in range(COUNT)]
        must_run("run", *harness.clip("map_front"), "--to", COUNT, "--groundtruth", harness.groundtruth("map_front"), "--scale-from", "gt", "--out", cls.path("metric"),
                 "--map-out", cls.metric)

    def drive(self, one, *options, peer=PEER, play=(), seconds=60):
        """The program's exit status, after the whole recording was played."""
        listener = one.listen("listener", seconds, peer)
        node = one.start("node", NODE, "image:=/camera/image_raw", "--out", os.path.join(one.folder, "out"), *options)
        player = one.start("player", peer, "play", self.recording, *play)
        assert player.wait(60) == 0
        return node, listener

    def test_it_tells_where_the_robot_is(self):
        unchanged = harness.read_bytes(self.metric)
        with robot(self.folder, "metric_robot") as one:
            node, _ = self.drive(one, "--map-in", self.metric, "--read-only", play=["best_effort"])
            assert "images of /camera/image_raw (sensor_msgs/Image, best effort)" in one.text("node")
            heard = one.heard("listener")
            poses = {stamp: pose for stamp, frame, pose in map(stamped_pose, heard["/oaslam/pose"]) if frame == "map"}
            # The first images may come before all nodes know each other.
            assert len(poses) == len(heard["/oaslam/pose"]) > 0.2 * COUNT, one.text("node")
            assert set(poses) <= set(self.stamps)
            odoms = [t for t in map(transform, heard["/tf"]) if t[1] == "map"]
            assert len(odoms) > 0.2 * COUNT and {t[2] for t in odoms} == {"odom"}, one.text("node")
            for stamp, _, _, map_from_odom in odoms:
                odom_from_base = np.eye(4)
                odom_from_base[:3, 3] = odom_at((stamp - START * 10**9) / 1e9)
                np.testing.assert_allclose(map_from_odom @ odom_from_base, poses[stamp], atol=1e-5)
            # The velocity is that between two poses, in the axes of the robot.
            reader = Reader(heard["/oaslam/odometry"][-1])
            now = reader.stamp()
            assert (reader.text(), reader.text()) == ("map", "base_link")
            before = max(stamp for stamp in poses if stamp < now)
            np.testing.assert_allclose(reader.pose(), poses[now])
            reader.get("d", 36)
            moved = poses[now][:3, 3] - poses[before][:3, 3]
            assert np.linalg.norm(moved) > 0.001
            np.testing.assert_allclose(reader.get("d", 3), poses[now][:3, :3].T @ moved / ((now - before) / 1e9), atol=1e-6)
            level, _, message = status_text(heard["/oaslam/status"][-3])
            assert (level, message) == (0, "tracking"), message

            late = one.listen("late", 4)
            late.wait(30)
            path, objects = (one.heard("late")[topic] for topic in ("/oaslam/path", "/oaslam/objects"))
            assert len(path) == len(objects) == 1 and len(objects[0]) > 1000
            assert one.stop(node) == 130
            assert os.path.exists(os.path.join(one.folder, "out", "map.oaslam"))
        assert harness.read_bytes(self.metric) == unchanged

    def test_a_camera_alone_whose_bag_is_played_twice(self):
        with robot(self.folder, "camera") as one:
            node, _ = self.drive(one, "--publish-camera-tf", play=["skip=/tf", "skip=/tf_static", "loops=2"])
            heard = one.heard("listener")
            poses = [stamp for stamp, *_ in map(stamped_pose, heard["/oaslam/pose"])]
            assert set(poses) <= set(self.stamps)
            assert "the time went back" in one.text("node")
            back = next(i for i in range(1, len(poses)) if poses[i] < poses[i - 1])
            assert back > 0.2 * COUNT and len(poses) - back > 0.2 * COUNT, (back, len(poses))
            transforms = list(map(transform, heard["/tf"]))
            assert {t[1:3] for t in transforms} == {("map", "camera")} and [t[0] for t in transforms] == poses
            assert one.stop(node) == 130
            done = must_run("info", os.path.join(one.folder, "out", "map.oaslam"))
            assert "keyframes" in done.out, done

    def test_it_says_what_is_missing(self):
        with robot(self.folder, "unit") as one:
            node, _ = self.drive(one)
            heard = one.heard("listener")
            assert len(heard["/oaslam/pose"]) > 0.2 * COUNT
            assert not [t for t in map(transform, heard["/tf"]) if t[1] == "map"]
            assert "the unit is not the metre" in one.text("node")
            # The camera stops: the node says so, and goes on once it is back.
            one.wait_for(lambda: "nobody publishes images on /camera/image_raw" in status_text(one.heard("listener")["/oaslam/status"][-1])[2])
            assert status_text(one.heard("listener")["/oaslam/status"][-1])[0] == 2 and node.poll() is None
            count = len(one.heard("listener")["/oaslam/pose"])
            one.start("again", PEER, "play", self.recording)
            one.wait_for(lambda: len(one.heard("listener")["/oaslam/pose"]) > count, 30)
            assert one.stop(node) == 130

    def test_topics_that_are_not_as_they_should_be(self):
        unset = self.path("unset.mcap")
        record(unset, 60, stamp=lambda second: -START)
        with robot(self.folder, "wrong") as one:
            nowhere = one.start("node", NODE, "--out", os.path.join(one.folder, "out"))
            one.wait_for(lambda: "nobody else publishes anything" in one.text("node"))
            players = [one.start(f"player{i}", PEER, "play", unset, "loops=9") for i in range(2)]
            one.wait_for(lambda: "topics of images: /camera/image_raw (sensor_msgs/Image); image:=TOPIC takes another" in one.text("node"))
            assert one.stop(nowhere) == 130
            node = one.start("node", NODE, "image:=/camera/image_raw", "--out", os.path.join(one.folder, "out"))
            one.wait_for(lambda: "have no time stamp (0)" in one.text("node") and "/camera/image_raw has 2 publishers" in one.text("node"))
            assert one.stop(node) == 130 and players[0].poll() is None
            assert not os.path.exists(os.path.join(one.folder, "out"))

    @pytest.mark.skipif(not os.path.exists(FAST_PEER), reason="needs libfastrtps-dev of version 2")
    @pytest.mark.parametrize("reliability", ["reliable", "best_effort"])
    def test_fast_dds(self, reliability):
        with robot(self.folder, "fast_" + reliability) as one:
            node, _ = self.drive(one, "--map-in", self.metric, peer=FAST_PEER, play=["best_effort"] if reliability == "best_effort" else [])
            heard = one.heard("listener")
            poses = [stamp for stamp, *_ in map(stamped_pose, heard["/oaslam/pose"])]
            assert set(poses) <= set(self.stamps) and len(poses) > 0.2 * COUNT, one.text("node")
            assert [t for t in map(transform, heard["/tf"]) if t[1:3] == ("map", "odom")]
            assert heard["/oaslam/path"] and heard["/oaslam/objects_3d"] and heard["/oaslam/odometry"]
            assert one.stop(node) == 130


def test_wrong_arguments():
    for arguments, what in ((["imag:=/camera"], "the topics are image, camera_info, imu"), (["image:=a b"], "is no topic"),
                            (["--read-only"], "--map-in"), (["--domain", "500"], "--domain")):
        done = subprocess.run([NODE, *arguments], capture_output=True, text=True, timeout=60)
        assert done.returncode != 0 and what in done.stderr + done.stdout, (arguments, done)
    done = subprocess.run([NODE, "image:=/camera"], capture_output=True, text=True, timeout=60, env={**os.environ, "ROS_DOMAIN_ID": "x"})
    assert done.returncode == 1 and "ROS_DOMAIN_ID: x" in done.stderr, done
