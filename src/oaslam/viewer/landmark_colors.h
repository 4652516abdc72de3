#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/features/features.h"
#include "oaslam/util/ids.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// The colour in which each landmark was first seen. The map itself has none.
class LandmarkColors {
 public:
  // `picture`: ideal image, BGR, `scale` of its pixels a pixel of the camera; `landmarks`: per key
  // point.
  void Add(const cv::Mat& picture, double scale, const Features& features,
           const std::vector<LandmarkId>& landmarks);
  void Clear();

  size_t size() const { return ids_.size(); }
  // Adds those behind the first `known`.
  void AddDelta(size_t known, MessageBuilder& message) const;

 private:
  std::vector<bool> has_color_;  // by id
  std::vector<uint32_t> ids_;    // in the order of their first sight
  std::vector<uint8_t> rgb_;
};

}  // namespace oaslam
