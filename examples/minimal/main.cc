// Passes the images of a video, and boxes of a detector in this program, to the library: minimal
// VIDEO FOCAL_LENGTH_PX [FRAMES]
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "oaslam/slam.h"

// Stands for any detector: reports every large, strongly coloured region as an object of class 0.
std::vector<oaslam::Detection> Detect(const cv::Mat& bgr) {
  cv::Mat hsv, saturated;
  cv::cvtColor(bgr, hsv, cv::COLOR_BGR2HSV);
  cv::inRange(hsv, cv::Scalar(0, 140, 60), cv::Scalar(180, 255, 255), saturated);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(saturated, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  std::vector<oaslam::Detection> found;
  for (const auto& contour : contours)
    if (const cv::Rect r = cv::boundingRect(contour); r.area() > 1500)
      found.push_back({.category_id = 0,
                       .score = 0.9,
                       .box = {double(r.x), double(r.y), double(r.br().x), double(r.br().y)}});
  return found;
}

int main(int argc, char** argv) try {
  cv::VideoCapture video(argc > 2 ? argv[1] : "");
  cv::Mat image;
  if (!video.read(image))
    return std::fprintf(stderr, "usage: minimal VIDEO FOCAL_LENGTH_PX [FRAMES]\n"), 2;
  oaslam::Camera camera{.width = image.cols, .height = image.rows};
  camera.fx = camera.fy = std::atof(argv[2]);
  camera.cx = 0.5 * (image.cols - 1);
  camera.cy = 0.5 * (image.rows - 1);

  oaslam::Slam slam(oaslam::SlamConfig::Offline(), camera);
  const int frames = argc > 3 ? std::atoi(argv[3]) : 1 << 30;
  for (int i = 0; i < frames && !image.empty(); ++i, video.read(image)) {
    const oaslam::TrackingResult result =
        slam.Process({.image = image, .timestamp = i / 30.0, .detections = Detect(image)});
    if (const std::optional<oaslam::Rigid3> pose = result.PoseIn(result.world)) {
      const Eigen::Vector3d p = pose->translation;
      std::printf("%d %s %.3f %.3f %.3f\n", i, oaslam::ToString(result.state), p.x(), p.y(), p.z());
    }
  }
  slam.Finish();
  const oaslam::MapSnapshot map = slam.Snapshot();
  std::printf("%zu keyframes, %zu landmarks, %zu objects\n", map.Keyframes().size(),
              map.Landmarks().size(), map.Objects().size());
} catch (const oaslam::InputError& error) {
  return std::fprintf(stderr, "minimal: %s\n", error.what()), 1;
}
