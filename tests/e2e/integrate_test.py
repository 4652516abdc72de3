"""The code of docs/integrate.md compiles as it is printed, and turns poses and images as the page says."""
import os
import re
import shutil
import subprocess
import unittest

import cluster
import harness

CHECKS = r"""
#include <cstdio>
#include <cstdlib>
#define EXPECT(condition) \
  if (!(condition)) std::printf("line %d: %s\n", __LINE__, #condition), std::exit(1)
using Eigen::Vector3d;

// A camera at 2 m height in a world that has x to the east, y to the north, z up. It looks to the east, level.
const Vector3d kCenter(5, 7, 2), kEast(1, 0, 0), kNorth(0, 1, 0), kUp(0, 0, 1);

int main(int argc, char** argv) {
  EXPECT(argc == 2);
  Eigen::Matrix3d axes;  // the camera's right, down and forward in that world
  axes << -kNorth, -kUp, kEast;
  const Rigid3 geo_from_cam(axes, kCenter);
  // The map's frame is that of a first camera, which stood elsewhere and was tilted.
  const Rigid3 geo_from_world(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized())) * axes, Vector3d(1, 2, 3));
  const Rigid3 world_from_cam = geo_from_world.Inverse() * geo_from_cam;
  const Vector3d up = geo_from_world.rotation.conjugate() * kUp;

  // Directions that the camera sees, as world vectors of the map.
  const auto turned = [&](const Vector3d& axis) { return Rigid3(Eigen::Quaterniond::FromTwoVectors(up, axis), Vector3d::Zero()); };
  const Rigid3 ros = turned(kUp), gl = turned(Vector3d::UnitY());
  const Rigid3 level = UprightFromWorld(oaslam::MapSnapshot(), Vector3d::UnitZ());
  EXPECT((level.rotation * Vector3d(0, -1, 0) - kUp).norm() < 1e-9);  // no vertical is known: the first image is level

  const Rigid3 optical = RosOpticalPose(ros, world_from_cam), body = RosBodyPose(ros, world_from_cam);
  EXPECT((optical.rotation * Vector3d(0, -1, 0) - kUp).norm() < 1e-9);
  EXPECT((body.rotation * Vector3d::UnitZ() - kUp).norm() < 1e-9);
  EXPECT((body.rotation * Vector3d::UnitX() - optical.rotation * Vector3d::UnitZ()).norm() < 1e-9);   // x is forward
  EXPECT((body.rotation * Vector3d::UnitY() + optical.rotation * Vector3d::UnitX()).norm() < 1e-9);   // y is left
  EXPECT((body.translation - optical.translation).norm() < 1e-9);

  const Eigen::Matrix4d pose = GlPose(gl, world_from_cam);
  EXPECT(std::abs(pose.topLeftCorner(3, 3).determinant() - 1) < 1e-9);
  EXPECT((pose.block(0, 1, 3, 1) - Vector3d::UnitY()).norm() < 1e-9);  // level: its y is up
  // A point 4 m before the camera, 1 m to the right and 0.5 m above, is at (1, 0.5, -4) of OpenGL's camera.
  const Vector3d in_world = world_from_cam * Vector3d(1, -0.5, 4);
  const Vector3d in_gl_world = gl * in_world;
  const Eigen::Vector4d seen = GlView(gl, world_from_cam) * in_gl_world.homogeneous();
  EXPECT((seen - Eigen::Vector4d(1, 0.5, -4, 1)).norm() < 1e-9);

  // In Unity it is at (1, 0.5, 4) of the camera; world points are those of OpenGL with their z mirrored.
  const UnityPose unity = ToUnity(pose);
  const Vector3d in_unity_world(in_gl_world.x(), in_gl_world.y(), -in_gl_world.z());
  EXPECT((unity.rotation * Vector3d(1, 0.5, 4) + unity.position - in_unity_world).norm() < 1e-9);

  oaslam::Camera camera{.width = 320, .height = 240, .fx = 300, .fy = 300, .cx = 160, .cy = 120};
  oaslam::Slam slam({}, camera);
  const std::vector<uint8_t> padded(240 * 384, 100);
  EXPECT(TrackGrey(slam, padded.data(), 320, 240, 384, 0).state == oaslam::TrackingState::kInitializing);
  oaslam::Slam other({}, camera);
  if (std::string(argv[1]) == "gstreamer")
    EXPECT(TrackPipeline(other, "videotestsrc num-buffers=5 ! video/x-raw,width=320,height=240") == 5);
}
"""


def blocks(language):
    with open(os.path.join(cluster.SOURCE, "docs", "integrate.md")) as f:
        return re.findall(rf"^```{language}\n(.*?)^```$", f.read(), re.M | re.S)


class Integrate(harness.InFolder):
    def test_the_code_of_the_page(self):
        with open(self.path("main.cc"), "w") as f:
            f.write("\n".join(blocks("cpp")) + CHECKS)
        with open(self.path("CMakeLists.txt"), "w") as f:
            f.write("cmake_minimum_required(VERSION 3.25)\nproject(integrate CXX)\nfind_package(oaslam REQUIRED)\nfind_package(OpenCV REQUIRED COMPONENTS videoio)\n"
                    "add_executable(integrate main.cc)\ntarget_link_libraries(integrate oaslam::oaslam opencv_videoio)\n")
        for command in (["cmake", "--install", os.environ["OASLAM_BUILD_DIR"], "--prefix", self.path("install")],
                        ["cmake", "-S", self.folder, "-B", self.path("build"), f"-DCMAKE_PREFIX_PATH={self.path('install')}"],
                        ["cmake", "--build", self.path("build")],
                        [self.path("build/integrate"), "gstreamer" if self.has_gstreamer() else "none"]):
            done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def has_gstreamer(self):
        """Whether the pipeline of the page has its parts here."""
        return bool(shutil.which("gst-inspect-1.0")) and all(
            subprocess.run(["gst-inspect-1.0", part], capture_output=True, check=False).returncode == 0 for part in ("videotestsrc", "videoconvert", "appsink"))

    def test_the_formula_in_cs_is_that_of_the_code(self):
        code = blocks("csharp")[0]
        self.assertIn("new Vector3(p.x, p.y, -p.z)", code)
        self.assertIn("new Quaternion(-q.x, -q.y, q.z, q.w)", code)
        self.assertIn("{{p.x(), p.y(), -p.z()}, {q.w(), -q.x(), -q.y(), q.z()}}", "\n".join(blocks("cpp")))


if __name__ == "__main__":
    unittest.main()
