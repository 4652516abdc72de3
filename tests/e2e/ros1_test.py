"""examples/ros1: the node maps a bag made of the sample, and finds the camera in a map of the command.

An image is sent when the one before is answered, so that nothing depends on speed."""
import math
import os
import queue
import shutil
import signal
import subprocess
import sys
import unittest

DEBIAN_PYTHON = "/usr/bin/python3"  # which Debian's packages of ROS are for
LIBRARIES = ["roscpp", "tf2_ros", "sensor_msgs", "geometry_msgs", "visualization_msgs"]
try:
    import rosbag
    import rospy
    from geometry_msgs.msg import PoseStamped, TransformStamped
    from sensor_msgs.msg import CameraInfo, Image
    from std_msgs.msg import String
    from tf2_msgs.msg import TFMessage
    from visualization_msgs.msg import Marker, MarkerArray
except ImportError as missing:
    if sys.executable != DEBIAN_PYTHON and os.path.exists(DEBIAN_PYTHON):
        os.execv(DEBIAN_PYTHON, [DEBIAN_PYTHON, *sys.argv])
    print("skipped:", missing)
    sys.exit(77)
if any(shutil.which(tool) is None for tool in ("rosmaster", "pkg-config", "cmake")) or subprocess.run(["pkg-config", "--exists", *LIBRARIES]).returncode:
    print("skipped: there is no rosmaster, or not all of", *LIBRARIES)
    sys.exit(77)

import cluster
import harness
from harness import oaslam

BEGIN = 1700000000  # of the bag; the sample begins at 0
WIDTH, HEIGHT = 640, 480
WAIT = 30  # seconds, for any one answer
# tan(x) as a series, with which an equidistant lens is a pinhole.
TANGENT = [1 / 3, 2 / 15, 17 / 315, 62 / 2835]
CHANNELS = {"mono8": "gray", "bgr8": "bgr24", "rgb8": "rgb24"}  # and ffmpeg's names
UP = [0.28, 0, 0.96]  # what the sensor says, in the sample's world; not what the images could tell
# base_link from the camera's optical frame: 0.3 m ahead, x ahead, z up.
MOUNT = ([0.3, 0.1, 0.5], [-0.5, 0.5, -0.5, 0.5])


def camera_info(model, distortion):
    return CameraInfo(width=WIDTH, height=HEIGHT, distortion_model=model, D=distortion, K=[525, 0, 319.5, 0, 525, 239.5, 0, 0, 1])


def images(encoding, count, step=1):
    """(index, pixels) of images of the clip."""
    video = os.path.join(harness.SAMPLE, "map_front", "video.mp4")
    command = ["ffmpeg", "-v", "error", "-i", video, "-frames:v", str(count), "-pix_fmt", CHANNELS[encoding], "-f", "rawvideo", "-"]
    pixels = subprocess.run(command, capture_output=True, check=True).stdout
    size = len(pixels) // count
    return [(i, pixels[i * size:(i + 1) * size]) for i in range(0, count, step)]


def write_bag(path, info, shown):
    """A bag of images (encoding, index, pixels) with their camera and its place on the robot."""
    with rosbag.Bag(path, "w") as bag:
        mount = TransformStamped(child_frame_id="camera_optical")
        mount.header.frame_id = "base_link"
        t, q = mount.transform.translation, mount.transform.rotation
        (t.x, t.y, t.z), (q.x, q.y, q.z, q.w) = MOUNT
        bag.write("/tf_static", TFMessage([mount]), rospy.Time(BEGIN))
        for encoding, i, pixels in shown:
            image = Image(width=WIDTH, height=HEIGHT, encoding=encoding, step=len(pixels) // HEIGHT, data=pixels)
            image.header.stamp, image.header.frame_id = rospy.Time.from_sec(BEGIN + i / 30), "camera_optical"
            info.header = image.header
            bag.write("/camera_info", info, image.header.stamp)
            bag.write("/image", image, image.header.stamp)


def pose_of(message):
    """(position, quaternion) of a Pose or a Transform."""
    p, q = (message.position, message.orientation) if hasattr(message, "position") else (message.translation, message.rotation)
    return [p.x, p.y, p.z], [q.x, q.y, q.z, q.w]


class Ros(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        build = os.path.dirname(harness.BINARY)
        source = os.path.join(os.environ["OASLAM_SOURCE_DIR"], "examples", "ros1")
        for command in (["cmake", "--install", build, "--prefix", cls.path("prefix")],
                        ["cmake", "-S", source, "-B", cls.path("build"), "-DCMAKE_PREFIX_PATH=" + cls.path("prefix")],
                        ["cmake", "--build", cls.path("build"), "--parallel", "2"]):
            done = subprocess.run(command, capture_output=True, text=True)
            assert done.returncode == 0, done.stdout + done.stderr
        port = cluster.free_port()
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=cls.path("ros"), ROS_LOG_DIR=cls.path("ros"),
                          OASLAM_MODELS=cls.path("prefix/share/oaslam/models"))
        cls.master = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cls.addClassCleanup(cls.master.wait, WAIT)
        cls.addClassCleanup(cls.master.terminate)
        cluster.wait_until(cls.master_answers, WAIT, "the master answers")
        rospy.init_node("player", disable_signals=True)
        cls.addClassCleanup(rospy.signal_shutdown, "the tests are over")

        gravity = cls.path("gravity.txt")
        with open(gravity, "w") as f:
            for t, _, (x, y, z, w) in harness.read_tum(harness.groundtruth("map_front"))[:150]:
                f.write(f"{t} " + " ".join(map(str, harness.rotate((-x, -y, -z, w), [-9.81 * u for u in UP]))) + "\n")
        cls.made = [oaslam("run", *harness.clip("map_front"), "--to", 150, "--gravity", gravity, "--out", cls.path("run"), "--map-out", cls.path("desk.map"))]

    @staticmethod
    def master_answers():
        try:
            return rospy.get_master().getPid()[0] == 1
        except OSError:
            return False

    def start(self, *parameters):
        """The node; it ends with the test. The master would keep the parameters of the one before."""
        if rospy.has_param("/oaslam"):
            rospy.delete_param("/oaslam")
        with open(self.path("log"), "w") as log:
            node = subprocess.Popen([self.path("build/oaslam_node"), *parameters], stdout=log, stderr=log)
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        return node

    def log(self):
        return harness.read_bytes(self.path("log")).decode()

    def take(self, node, messages):
        """The next message."""
        for _ in range(WAIT):
            try:
                return messages.get(timeout=1)
            except queue.Empty:
                if node.poll() is not None:
                    break
        self.fail("no answer: " + self.log())

    def play(self, node, bag):
        """Sends a bag; returns the messages of pose, tf and objects."""
        received = {"state": queue.Queue(), "pose": queue.Queue(), "tf": queue.Queue(), "objects": queue.Queue()}
        types = {"state": String, "pose": PoseStamped, "tf": TFMessage, "objects": MarkerArray}
        topics = [rospy.Subscriber("/" + name, types[name], received[name].put) for name in types]
        senders = {"/camera_info": rospy.Publisher("/camera_info", CameraInfo, queue_size=1, latch=True),
                   "/tf_static": rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True),
                   "/image": rospy.Publisher("/image", Image, queue_size=1)}
        links = topics + list(senders.values())
        for link in links:
            self.addCleanup(link.unregister)
        cluster.wait_until(lambda: all(link.get_num_connections() for link in links) or node.poll() is not None, WAIT, "the node is there")
        poses, transforms = [], []
        with rosbag.Bag(bag) as messages:
            for topic, message, _ in messages.read_messages():
                if topic == "/camera_info" and poses:
                    continue
                senders[topic].publish(message)
                if topic != "/image":
                    continue
                while (state := self.take(node, received["state"]).data) == "no camera_info":
                    senders[topic].publish(message)
                if state in ("tracking", "relocalized", "objects"):
                    poses.append(self.take(node, received["pose"]))
                    transforms += self.take(node, received["tf"]).transforms
                    self.assertEqual(poses[-1].header.stamp, message.header.stamp)
        objects = self.take(node, received["objects"])
        while not received["objects"].empty():
            objects = received["objects"].get()
        return poses, transforms, objects.markers

    def alignment(self, poses, bound):
        """The similarity from the poses to the truth, in metres."""
        matched = harness.pairs([(p.header.stamp.to_sec() - BEGIN, *pose_of(p.pose)) for p in poses], harness.read_tum(harness.groundtruth("map_front")))
        sim = harness.similarity(matched)
        self.assertEqual(len(matched), len(poses))
        self.assertLess(harness.rmse(harness.distances(matched, sim)), bound)
        return sim

    def test_it_maps_a_bag(self):
        write_bag(self.path("walk.bag"), camera_info("plumb_bob", [0] * 5), [("mono8", *image) for image in images("mono8", 150)])
        node = self.start("_save:=" + self.path("live.map"), "_child_frame:=base_link", "_map_frame:=world")
        poses, transforms, _ = self.play(node, self.path("walk.bag"))
        self.assertGreater(len(poses), 75)
        self.alignment(poses, 0.06)  # live: as of trajectory_live.txt in sample_test
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(WAIT), 0, self.log())
        self.assertEqual(oaslam("info", self.path("live.map")).code, 0)

        self.assertEqual(len(transforms), len(poses))
        for pose, transform in zip(poses, transforms):
            self.assertEqual((pose.header.frame_id, transform.header.frame_id, transform.child_frame_id), ("world", "world", "base_link"))
            at, turn = pose_of(transform.transform)
            camera = [a + b for a, b in zip(at, harness.rotate(turn, MOUNT[0]))]
            ahead = harness.rotate(turn, harness.rotate(MOUNT[1], [0, 0, 1]))
            self.assertLess(math.dist(camera, pose_of(pose.pose)[0]), 1e-9)
            self.assertLess(math.dist(ahead, harness.rotate(pose_of(pose.pose)[1], [0, 0, 1])), 1e-9)

    def test_it_finds_the_camera_in_a_map(self):
        shown = [("bgr8", *image) for image in images("bgr8", 30, 6)] + [("rgb8", *image) for image in images("rgb8", 150, 6) if image[0] >= 30]
        write_bag(self.path("visit.bag"), camera_info("equidistant", TANGENT), shown)
        node = self.start("_map:=" + self.path("desk.map"), "_mapping:=false", "_detector:=none")
        poses, transforms, markers = self.play(node, self.path("visit.bag"))
        self.assertEqual(len(poses), len(shown))
        self.assertEqual({t.child_frame_id for t in transforms}, {"camera_optical"})
        sim = self.alignment(poses, 0.01)
        self.assertLess(math.dist(harness.rotate(sim[1], [0, 0, 1]), UP), math.radians(1))  # z is up

        first, *markers = markers
        self.assertEqual(first.action, Marker.DELETEALL)
        mapped = harness.read_json(os.path.join(self.path("run"), "objects.json"))
        self.assertEqual(sorted(m.id for m in markers), sorted(o["id"] for o in mapped))
        self.assertGreater(len(mapped), 10)
        in_truth = harness.map_alignment(self.path("run"))
        for marker in markers:
            o, = (o for o in mapped if o["id"] == marker.id)
            self.assertEqual((marker.type, marker.header.frame_id, marker.text), (Marker.SPHERE, "map", o["category"]))
            self.assertLess(math.dist(harness.apply(sim, pose_of(marker.pose)[0]), harness.apply(in_truth, o["center"])), 0.04)
            for extent, half in zip((marker.scale.x, marker.scale.y, marker.scale.z), o["half_axes"]):
                self.assertAlmostEqual(extent, 2 * half, places=4)

    def test_bad_input_ends_it(self):
        sample = camera_info("plumb_bob", [])
        for name, info, encoding, parameter, word in (
                ("lens", camera_info("rational_polynomial", [0] * 8), "mono8", "_mapping:=true", "distortion_model: rational_polynomial"),
                ("encoding", sample, "16UC1", "_mapping:=true", "encoding: 16UC1"),
                ("config", sample, "mono8", "_config:=/no/settings.yaml", "/no/settings.yaml"),
                ("map", sample, "mono8", "_map:=/no/desk.map", "/no/desk.map")):
            node = self.start("_detector:=none", parameter)
            senders = {"/camera_info": rospy.Publisher("/camera_info", CameraInfo, queue_size=1), "/image": rospy.Publisher("/image", Image, queue_size=1)}
            image = Image(width=WIDTH, height=HEIGHT, encoding=encoding, step=2 * WIDTH, data=bytes(2 * WIDTH * HEIGHT))

            def has_ended():
                senders["/camera_info"].publish(info)
                senders["/image"].publish(image)
                return node.poll() is not None
            cluster.wait_until(has_ended, WAIT, name)
            self.assertEqual(node.returncode, 1)
            self.assertIn(word, self.log())


if __name__ == "__main__":
    unittest.main(verbosity=2, warnings="ignore")  # of rospy
