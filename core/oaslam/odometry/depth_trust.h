#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace oaslam {

// Whether a depth camera agrees with what the images tell, as seen from time to time.
class DepthTrust {
 public:
  // A depth that was measured, by the one that the images tell, and the sigma of the logarithm.
  struct View {
    double log_ratio = 0, sigma = 0;
  };
  using Views = std::vector<View>;
  // Depths are also looked up where their image is magnified by these factors: they fit best there
  // if the camera of the depths, to which they are not registered, has another focal length.
  static constexpr std::array kZooms{0.85F, 0.9F, 0.95F, 1.0F, 1.05F, 1.1F, 1.15F};
  static constexpr size_t kUnzoomed = 3;

  bool IsDue(double time_s) const;
  // The points of an image, for each zoom.
  void Add(double time_s, std::span<const Views> at_zooms);
  // In a sentence's end; empty while there is none.
  std::string Problem() const;

 private:
  std::optional<double> judged_s_;
  int views_ = 0;
  // Sums over the views: of the shares of depths that contradict the images, and of the spread.
  double share_off_ = 0;
  std::array<double, kZooms.size()> spread_{};
};

}  // namespace oaslam
