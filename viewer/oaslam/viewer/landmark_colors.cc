#include "oaslam/viewer/landmark_colors.h"

#include <cmath>

namespace oaslam {

void LandmarkColors::Add(const cv::Mat& picture, double scale, const Features& features,
                         const std::vector<LandmarkId>& landmarks) {
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const uint32_t id = landmarks[i].value;
    if (!landmarks[i].IsValid() || (id < has_color_.size() && has_color_[id])) continue;
    const auto x = static_cast<int>(std::floor((features.keypoints[i].px.x() + 0.5) * scale));
    const auto y = static_cast<int>(std::floor((features.keypoints[i].px.y() + 0.5) * scale));
    if (x < 0 || y < 0 || x >= picture.cols || y >= picture.rows) continue;
    if (id >= has_color_.size()) has_color_.resize(id + 1);
    has_color_[id] = true;
    ids_.push_back(id);
    const auto& bgr = picture.at<cv::Vec3b>(y, x);
    rgb_.insert(rgb_.end(), {bgr[2], bgr[1], bgr[0]});
  }
}

void LandmarkColors::Clear() {
  has_color_.clear();
  ids_.clear();
  rgb_.clear();
}

void LandmarkColors::AddDelta(size_t known, MessageBuilder& message) const {
  message.Add("color_ids", std::span(ids_).subspan(known));
  message.Add("colors", std::span(rgb_).subspan(3 * known));
}

}  // namespace oaslam
