#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/features/features.h"
#include "oaslam/ids.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// The colour of each landmark when it was first seen. The map itself stores no colours.
class LandmarkColors {
 public:
  // `picture`: the ideal image, BGR, scaled by `scale` relative to the camera's pixels;
  // `landmarks`: by key point.
  void Add(const cv::Mat& picture, double scale, const Features& features,
           const std::vector<LandmarkId>& landmarks);
  void Clear();

  size_t size() const { return ids_.size(); }
  // Adds all colours after the first `known` to a message.
  void AddDelta(size_t known, MessageBuilder& message) const;

 private:
  std::vector<bool> has_color_;  // by id
  std::vector<uint32_t> ids_;    // in the order in which they were first seen
  std::vector<uint8_t> rgb_;
};

}  // namespace oaslam
