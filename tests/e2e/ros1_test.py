"""The ROS 1 node of examples/ros1, built against an installed copy and given a bag: it says for each image what `oaslam run` says. Skipped where Debian's
packages of ROS are missing (docs/integrate.md names them)."""
import os
import shutil
import signal
import subprocess
import sys
import unittest

import cluster
import harness

FIRST, FRAMES = 30, 60  # time 0 is none for ROS
# Runs in Debian's Python, which ROS is installed for. It makes a bag of the images of a folder, publishes it image by image when the
# node has answered the one before, and prints "TIME STATE TX TY TZ QX QY QZ QW" for each.
FEEDER = '''
import queue, sys
import cv2, rosbag, rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

folder, bag_path = sys.argv[1:]
with rosbag.Bag(bag_path, "w") as bag:
    for line in open(folder + "/rgb.txt"):
        time, path = line.split()
        pixels = cv2.imread(folder + "/" + path, cv2.IMREAD_GRAYSCALE)
        image = Image(height=pixels.shape[0], width=pixels.shape[1], encoding="mono8", step=pixels.shape[1], data=pixels.tobytes())
        image.header.stamp = rospy.Time.from_sec(float(time))
        image.header.frame_id = "camera_optical"
        info = CameraInfo(height=image.height, width=image.width, distortion_model="plumb_bob", D=[0] * 5, K=[525, 0, 319.5, 0, 525, 239.5, 0, 0, 1])
        bag.write("camera_info", info, image.header.stamp)
        bag.write("image", image, image.header.stamp)

rospy.init_node("feeder", disable_signals=True)
poses, states, markers = queue.Queue(), queue.Queue(), queue.Queue()
rospy.Subscriber("pose", PoseStamped, poses.put)
rospy.Subscriber("state", String, states.put)
rospy.Subscriber("objects", MarkerArray, markers.put)
publishers = {"image": rospy.Publisher("image", Image, queue_size=10), "camera_info": rospy.Publisher("camera_info", CameraInfo, queue_size=10, latch=True)}
while any(p.get_num_connections() == 0 for p in publishers.values()):
    rospy.sleep(0.05)
is_first = True
for topic, message, time in rosbag.Bag(bag_path).read_messages():
    if topic == "camera_info":
        if is_first:
            publishers[topic].publish(message)
        continue
    while True:
        publishers[topic].publish(message)
        try:
            state = states.get(timeout=2 if is_first else 60).data
            break
        except queue.Empty:  # the node has the camera only after a moment, and drops images until then
            if not is_first:
                raise
    is_first = False
    line = [message.header.stamp.to_sec(), state]
    if state in ("tracking", "relocalized"):
        pose = poses.get(timeout=60)
        assert pose.header.stamp == time and pose.header.frame_id == "map", pose.header
        p, q = pose.pose.position, pose.pose.orientation
        line += [f"{x:.7f}" for x in (p.x, p.y, p.z, q.x, q.y, q.z, q.w)]
    print(*line, flush=True)
assert not markers.empty()
'''


def missing():
    done = subprocess.run(["pkg-config", "--exists", "roscpp", "sensor_msgs", "geometry_msgs", "std_msgs", "visualization_msgs", "tf2_ros"], check=False) \
        if shutil.which("pkg-config") else None
    if done is None or done.returncode:
        return "ROS 1 (roscpp and messages)"
    if not shutil.which("rosmaster"):
        return "rosmaster"
    done = subprocess.run(["/usr/bin/python3", "-c", "import cv2, rosbag, rospy, visualization_msgs.msg"], capture_output=True, check=False)
    return "rosbag, rospy or cv2 of Python" if done.returncode else ""


class Ros1(harness.InFolder):
    def start(self, *command):
        process = subprocess.Popen(list(map(str, command)), env=self.env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def call(self, *command):
        done = subprocess.run(list(map(str, command)), env=self.env, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_the_node_says_what_the_command_says(self):
        port = cluster.free_port()
        self.env = {**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_HOME": self.folder, "ROS_LOG_DIR": self.folder}
        build = os.environ["OASLAM_BUILD_DIR"]
        self.call("cmake", "--install", build, "--prefix", self.path("install"))
        self.call("cmake", "-S", os.path.join(cluster.SOURCE, "examples", "ros1"), "-B", self.path("build"), f"-DCMAKE_PREFIX_PATH={self.path('install')}")
        self.call("cmake", "--build", self.path("build"), "--parallel", "2")
        clip = os.path.join(harness.SAMPLE, "map_front")
        self.call(os.environ["OASLAM_EXTRACT_FRAMES"], os.path.join(clip, "video.mp4"), self.path("frames"), FIRST, FIRST + FRAMES)

        self.start("rosmaster", "--core", "-p", port)
        map_out = self.path("ros.map")
        node = self.start(self.path("build/oaslam_node"), "_mode:=lockstep", "_detector:=", f"_map_out:={map_out}")
        said = self.call("/usr/bin/python3", "-c", FEEDER, self.path("frames"), self.path("walk.bag")).splitlines()
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(60), 0, node.stdout.read())

        self.call(harness.BINARY, "run", "--images", self.path("frames"), "--camera", os.path.join(clip, "camera.yaml"), "--out", self.path("run"))
        expected = harness.read_tum(self.path("run/trajectory_live.txt"))
        self.assertEqual(len(said), FRAMES)
        self.assertGreater(len(expected), FRAMES // 2)
        found = [line.split() for line in said if len(line.split()) > 2]
        self.assertEqual(len(found), len(expected))
        for (time, _, *pose), (expected_time, position, rotation) in zip(found, expected):
            self.assertAlmostEqual(float(time), expected_time, places=5)
            for ours, theirs in zip(pose, position + rotation):
                self.assertAlmostEqual(float(ours), theirs, places=5)
        self.assertIn("ok", self.call(harness.BINARY, "info", map_out))



if __name__ == "__main__":
    if missing():
        print(f"ros1: skipped: there is no {missing()}", file=sys.stderr)
        sys.exit(77)
    unittest.main()
