#include "oaslam/viewer/crops.h"

#include <algorithm>
#include <cstdlib>

#include "oaslam/viewer/picture.h"

namespace oaslam {

void Crops::Add(ObjectId object, int frame, const cv::Mat& picture, double scale, const Box& box) {
  constexpr int kMaxSide = 160, kQuality = 80;  // pixels, as the page shows them; of JPEG
  std::vector<Crop>& crops = crops_[object];
  if (std::ranges::any_of(
          crops, [&](const Crop& c) { return std::abs(c.frame - frame) < kMinFramesBetween; }))
    return;
  const cv::Mat cut = CutOut(picture, scale, box, kMaxSide);
  if (cut.empty()) return;
  const auto place = std::ranges::upper_bound(crops, frame, {}, &Crop::frame);
  crops.insert(place, {frame, EncodeJpeg(cut, kQuality)});
  if (crops.size() <= kMaxCrops) return;
  // Drops the picture whose neighbours in time are closest together; the first
  // and the last are kept.
  size_t least = 1;
  for (size_t i = 2; i + 1 < crops.size(); ++i)
    if (crops[i + 1].frame - crops[i - 1].frame < crops[least + 1].frame - crops[least - 1].frame)
      least = i;
  crops.erase(crops.begin() + static_cast<std::ptrdiff_t>(least));
}

const std::vector<Crops::Crop>& Crops::Of(ObjectId object) const {
  static const std::vector<Crop> none;
  const auto found = crops_.find(object);
  return found == crops_.end() ? none : found->second;
}

}  // namespace oaslam
