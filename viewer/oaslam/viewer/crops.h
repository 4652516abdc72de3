#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "oaslam/ids.h"
#include "oaslam/types.h"

namespace oaslam {

// A few pictures of each object, spread over the time it was seen.
class Crops {
 public:
  struct Crop {
    int frame = 0;
    std::vector<uint8_t> jpeg;
  };
  static constexpr size_t kMaxCrops = 8;  // a row of the page's panel
  static constexpr int kMinFramesBetween =
      15;  // half a second of video; until then views are alike

  // `picture`: the ideal image, scaled by `scale` relative to the camera's pixels.
  void Add(ObjectId object, int frame, const cv::Mat& picture, double scale, const Box& box);
  void Clear() { crops_.clear(); }

  const std::vector<Crop>& Of(ObjectId object) const;  // ascending by frame

 private:
  std::map<ObjectId, std::vector<Crop>> crops_;
};

}  // namespace oaslam
