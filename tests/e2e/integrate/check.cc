// Runs the C++ of docs/integrate.md: check poses | check images FILE FRAMES [PIPELINE...]
#ifdef WITH_GSTREAMER
#include <gst/app/gstappsink.h>
#include <gst/video/video.h>
#endif

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/oaslam.h"

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Up = std::optional<Vector3d>;

// The blocks of the page, by their order.
#include "0.inc"
#include "4.inc"
#ifdef WITH_GSTREAMER
#include "5.inc"
#endif

namespace {

#define EXPECT(condition) \
  if (!(condition)) std::printf("line %d: %s\n", __LINE__, #condition), std::exit(1)

bool IsNear(const Vector3d& a, const Vector3d& b) { return (a - b).norm() < 1e-6; }

struct Ros {
  Ros(const oaslam::Rigid3& world_from_cam, const Up& up) {
#include "1.inc"
    optical = map_from_optical, body = map_from_body, axes = world;
  }
  oaslam::Rigid3 optical, body;
  Matrix3d axes;
};

struct Gl {
  Gl(const oaslam::Rigid3& world_from_cam, const Up& up) {
#include "2.inc"
    camera = pose, matrix = transform, view_matrix = view, axes = world;
  }
  oaslam::Rigid3 camera;
  Eigen::Matrix4f matrix, view_matrix;
  Matrix3d axes;
};

struct Unity {
  Unity(const oaslam::Rigid3& world_from_cam, const Up& up) {
#include "3.inc"
    camera = pose, axes = world;
  }
  oaslam::Rigid3 camera;
  Matrix3d axes;
};

// The first camera looks down by 30 degrees, and knows where up is. Another one is a metre to its
// right and looks the same way, but turned to the left by 90 degrees about the vertical.
void CheckTheVertical() {
  const double sine = 0.5, cosine = std::sqrt(0.75);
  const Vector3d up(0, -cosine, -sine);
  const oaslam::Rigid3 first;
  const oaslam::Rigid3 other(Quaterniond(Eigen::AngleAxisd(M_PI / 2, up)), Vector3d(1, 0, 0));

  const Ros a(first, up), b(other, up);
  EXPECT(IsNear(a.body.rotation * Vector3d::UnitX(), {cosine, 0, -sine}));  // looks ahead and down
  EXPECT(IsNear(a.optical.rotation * Vector3d::UnitZ(), {cosine, 0, -sine}));  // the same
  EXPECT(IsNear(b.optical.rotation * Vector3d::UnitZ(), {0, cosine, -sine}));  // left is y
  EXPECT(IsNear(b.body.rotation * Vector3d::UnitX(), {0, cosine, -sine}));
  EXPECT(IsNear(b.body.translation, {0, -1, 0}) && IsNear(b.optical.translation, {0, -1, 0}));

  const Gl c(first, up), d(other, up);
  EXPECT(IsNear(c.camera.rotation * Vector3d(0, 0, -1), {0, -sine, -cosine}));
  EXPECT(IsNear(d.camera.rotation * Vector3d(0, 0, -1), {-cosine, -sine, 0}));  // left is -x
  EXPECT(IsNear(d.camera.translation, {1, 0, 0}));
  EXPECT(d.matrix.data()[12] == 1 && d.matrix.data()[3] == 0);  // column by column
  const Eigen::Vector4f ahead = d.view_matrix * Eigen::Vector4f(1 - 2 * cosine, -2 * sine, 0, 1);
  EXPECT((ahead - Eigen::Vector4f(0, 0, -2, 1)).norm() < 1e-5f);

  const Unity e(first, up), f(other, up);
  EXPECT(IsNear(e.camera.rotation * Vector3d::UnitZ(), {0, -sine, cosine}));
  EXPECT(IsNear(f.camera.rotation * Vector3d::UnitZ(), {-cosine, -sine, 0}));
  EXPECT(IsNear(f.camera.rotation * Vector3d::UnitX(), {0, 0, 1}));  // its right is ahead
  EXPECT(IsNear(f.camera.translation, {1, 0, 0}));
}

// Points on the surface are on it in other systems, too.
void CheckEllipsoids(const Matrix3d& world) {
  const oaslam::Ellipsoid e{
      {1, 2, 3}, {0.3, 0.5, 0.7}, Quaterniond(0.5, 0.1, -0.4, 0.7).normalized()};
  const oaslam::Ellipsoid converted = Converted(e, world);
  EXPECT(std::abs(converted.rotation.norm() - 1) < 1e-9);
  for (int i = 0; i < 20; ++i) {
    const Vector3d direction = Vector3d::Random().normalized();
    const Vector3d point = e.center + e.rotation * e.half_axes.cwiseProduct(direction);
    const Vector3d local = converted.rotation.conjugate() * (world * point - converted.center);
    EXPECT(std::abs(local.cwiseQuotient(converted.half_axes).norm() - 1) < 1e-9);
  }
}

void Print(const char* name, const oaslam::Rigid3& pose) {
  std::printf("%s", name);
  for (const double x : pose.translation) std::printf(" %.9f", x);
  for (const double x : pose.rotation.coeffs()) std::printf(" %.9f", x);
  std::printf("\n");
}

// For the table of the page, any poses, also in systems whose camera has a point where it is.
void PrintPoses() {
  for (int i = 0; i < 5; ++i) {
    const oaslam::Rigid3 pose(Quaterniond(Eigen::Vector4d::Random()).normalized(),
                              Vector3d::Random());
    const Ros ros(pose, std::nullopt);
    const Gl gl(pose, std::nullopt);
    const Unity unity(pose, std::nullopt);
    const Vector3d seen = Vector3d::Random(), there = pose * seen;
    EXPECT(IsNear(ros.optical * seen, ros.axes * there));
    EXPECT(IsNear(ros.body * (kRos * seen), ros.axes * there));
    EXPECT(IsNear(gl.camera * (kOpenGl * seen), gl.axes * there));
    EXPECT(IsNear(unity.camera * (kUnity * seen), unity.axes * there));
    const oaslam::Rigid3 back =
        Converted(gl.camera, gl.axes.transpose(), Matrix3d(kOpenGl.transpose()));
    EXPECT(IsNear(back * seen, there));
    Print("ours", pose);
    Print("ROS, body", ros.body);
    Print("OpenGL, ARKit, ARCore", gl.camera);
    Print("Unity", unity.camera);
  }
  for (const Matrix3d& axes : {kRos, kOpenGl, kUnity}) CheckEllipsoids(axes);
}

constexpr int kWidth = 640, kHeight = 480;

oaslam::Slam NewSlam() {
  oaslam::Camera camera{.width = kWidth, .height = kHeight};
  camera.fx = camera.fy = 525, camera.cx = 319.5, camera.cy = 239.5;
  return {oaslam::SlamConfig::Offline(), camera};
}

void Print(const std::string& name, const oaslam::Slam& slam) {
  for (const auto& pose : slam.Trajectory()) {
    std::printf("%s %.6f", name.c_str(), pose.timestamp);
    Print("", pose.world_from_cam);
  }
}

// The trajectory of grey images, 25 a second, from memory whose rows are padded and end where it
// does, and from pipelines.
void TrackImages(const char* path, int frames, const std::vector<std::string>& pipelines) {
  std::ifstream file(path, std::ios::binary);
  constexpr size_t kRow = kWidth + 96;
  oaslam::Slam slam = NewSlam();
  for (int i = 0; i < frames; ++i) {
    std::vector<uint8_t> pixels(kRow * kHeight, 77);
    for (int y = 0; y < kHeight; ++y)
      file.read(reinterpret_cast<char*>(pixels.data() + y * kRow), kWidth);
    EXPECT(file.good());
    Track(slam, pixels.data(), kWidth, kHeight, kRow, i / 25.0);
  }
  Print("memory", slam);
#ifdef WITH_GSTREAMER
  gst_init(nullptr, nullptr);
  for (size_t i = 0; i < pipelines.size(); ++i) {
    oaslam::Slam another = NewSlam();
    TrackPipeline(another, pipelines[i]);
    Print("pipeline" + std::to_string(i), another);
  }
#endif
  (void)pipelines;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 3) {
    TrackImages(argv[2], std::atoi(argv[3]), {argv + 4, argv + argc});
  } else {
    CheckTheVertical();
    PrintPoses();
  }
}
