// Tracks a live camera: live_camera SOURCE CAMERA PICTURE [SECONDS]. SOURCE: webcam:0, or a video
// that is played at its own speed. CAMERA: a calibration or fov:DEGREES. Tracking and mapping, a
// detector, a display and a viewer run side by side; the display gets the newest state without a
// lock, the viewer is a page for browsers. The last drawn image is written to PICTURE. Without a
// detector (`oaslam models get yolox_nano` fetches one) there are no objects.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "oaslam/map_viewer.h"
#include "oaslam/oaslam.h"

namespace {

// Prints a line for each new state; skips states that are replaced while a line is printed.
void Show(const oaslam::SlamStates& states, const std::stop_token& stop) {
  std::shared_ptr<const oaslam::SlamState> shown;
  while (!stop.stop_requested()) {
    const auto state = states.WaitForNext(shown, std::chrono::milliseconds(100));
    if (!state) continue;
    shown = state;
    std::printf("%d %s: %zu keyframes, %zu landmarks, %zu objects\n", state->result.frame,
                oaslam::ToString(state->result.state), state->map.Keyframes().size(),
                state->map.Landmarks().size(), state->map.Objects().size());
  }
}

cv::Mat Picture(const cv::Mat& image, const std::vector<oaslam::TrackedPoint>& points) {
  cv::Mat picture;
  if (image.channels() == 1)
    cv::cvtColor(image, picture, cv::COLOR_GRAY2BGR);
  else
    picture = image.clone();
  for (const oaslam::TrackedPoint& point : points)
    if (point.landmark)
      cv::circle(picture, cv::Point(cvRound(point.pixel.x()), cvRound(point.pixel.y())), 3,
                 {60, 220, 60}, 1, cv::LINE_AA);
  return picture;
}

std::unique_ptr<oaslam::Detector> DetectorIfHere() {
  try {
    return oaslam::Detector::Load("default");
  } catch (const oaslam::InputError& error) {
    std::fprintf(stderr, "live_camera: points alone: %s\n", error.what());
    return nullptr;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr, "usage: live_camera SOURCE CAMERA PICTURE [SECONDS]\n"), 2;
  try {
    // Images that come while one is tracked are left out.
    const auto images = oaslam::OpenCamera(argv[1], {.color_if_free = true});
    std::optional<oaslam::InputImage> image = images->Next();
    if (!image) return std::fprintf(stderr, "live_camera: no image\n"), 1;
    oaslam::Slam slam(oaslam::SlamConfig::Live(), oaslam::LoadCamera(argv[2], image->image.size()));
    const std::unique_ptr<oaslam::Detector> detector = DetectorIfHere();
    oaslam::BackgroundDetector boxes([&](const cv::Mat& i) {
      return detector ? detector->Detect(i) : std::vector<oaslam::Detection>{};
    });
    const std::jthread display(
        [states = slam.States()](const std::stop_token& stop) { Show(states, stop); });

    oaslam::MapViewer viewer(slam, {.port = 0, .title = argv[1]});
    std::printf("viewer: %s\n", viewer.url().c_str());
    std::fflush(stdout);

    const double begin = image->timestamp, seconds = argc > 4 ? std::atof(argv[4]) : 1e9;
    cv::Mat picture;
    for (; image && image->timestamp - begin < seconds; image = images->Next()) {
      const oaslam::ImageInput input{
          .image = image->image, .timestamp = image->timestamp, .detections_follow = true};
      const oaslam::TrackingResult result = slam.Process(input);
      boxes.Offer(result.frame, image->image);
      for (const auto& late : boxes.Take()) slam.AddDetections(late.frame, late.detections);
      viewer.Show(slam, input, result);
      if (result.HasPose()) picture = Picture(image->image, slam.TrackedPoints());
    }
    slam.Finish();
    viewer.ShowMap(slam);
    if (picture.empty()) return std::fprintf(stderr, "live_camera: nothing was tracked\n"), 1;
    cv::imwrite(argv[3], picture);
    std::printf("%zu keyframes in the end\n", slam.Snapshot().Keyframes().size());
  } catch (const oaslam::InputError& error) {
    return std::fprintf(stderr, "live_camera: %s\n", error.what()), 1;
  }
}
