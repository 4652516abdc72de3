// Places content in the middle of an image, and draws where it is in a later one:
//   ar_anchors SOURCE CAMERA PICTURE [FRAMES]
// SOURCE: a video or a folder of images. CAMERA: a calibration or fov:DEGREES.
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "oaslam/oaslam.h"

namespace {

// Pixel of a point; nothing for a point behind the camera.
std::optional<cv::Point> Project(const oaslam::Camera& camera, const Eigen::Vector3d& in_cam) {
  const auto pixel = camera.Project(in_cam);
  if (!pixel) return std::nullopt;
  return cv::Point(cvRound(pixel->x()), cvRound(pixel->y()));
}

void Draw(const oaslam::Rigid3& cam_from_anchor, double size, const oaslam::Camera& camera,
          cv::Mat& picture) {
  const auto at = [&](const Eigen::Vector3d& in_anchor) {
    return Project(camera, cam_from_anchor * (size * in_anchor));
  };
  const auto origin = at(Eigen::Vector3d::Zero());
  const cv::Scalar colors[] = {{60, 60, 230}, {60, 200, 60}, {230, 120, 40}};  // x, y (up), z
  for (int axis = 0; axis < 3; ++axis)
    if (const auto end = at(Eigen::Vector3d::Unit(axis)); origin && end)
      cv::arrowedLine(picture, *origin, *end, colors[axis], 3, cv::LINE_AA);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr, "usage: ar_anchors SOURCE CAMERA PICTURE [FRAMES]\n"), 2;
  try {
    const auto images = oaslam::OpenImages(argv[1], {.color = true});
    const int frames = argc > 4 ? std::atoi(argv[4]) : 1 << 30;
    std::optional<oaslam::Slam> slam;
    oaslam::Camera camera;
    cv::Mat picture;
    for (int i = 0; i < frames; ++i) {
      const std::optional<oaslam::InputImage> image = images->Next();
      if (!image) break;
      if (image->image.empty()) continue;
      if (!slam) {
        camera = oaslam::LoadCamera(argv[2], image->image.size());
        slam.emplace(oaslam::SlamConfig::Offline(), camera);
      }
      const oaslam::TrackingResult result =
          slam->Process({.image = image->image, .timestamp = image->timestamp});
      if (result.state != oaslam::TrackingState::kTracking) continue;
      if (slam->Anchors().empty()) {
        const Eigen::Vector2d middle(camera.width / 2., camera.height / 2.);
        const oaslam::AnchorReport placed =
            slam->PlaceAnchor({.name = "here", .model = "axes", .pixel = middle});
        if (!placed.IsDone()) std::fprintf(stderr, "not yet: %s\n", placed.why_not.c_str());
      }
      picture = image->image.clone();
      for (const oaslam::AnchorPose& anchor : slam->Anchors()) {
        if (!anchor.cam_from_anchor) continue;
        Draw(*anchor.cam_from_anchor, anchor.size, camera, picture);
        if (const auto at = Project(camera, anchor.cam_from_anchor->translation))
          std::printf("%d %d %d\n", result.frame, at->x, at->y);
      }
    }
    if (picture.empty()) return std::fprintf(stderr, "ar_anchors: nothing was tracked\n"), 1;
    cv::imwrite(argv[3], picture);
  } catch (const oaslam::InputError& error) {
    return std::fprintf(stderr, "ar_anchors: %s\n", error.what()), 1;
  }
}
