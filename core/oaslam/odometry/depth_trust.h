#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace oaslam {

// A way to read depths: magnified by `zoom`, as they fit best if the camera of the depths, to which
// they are not registered, has another focal length; with `offset` metres added; or those that came
// `delay` seconds after the image.
struct DepthReading {
  float zoom = 1;
  double offset = 0, delay = 0;
};

// Whether a depth camera agrees with what the images tell, as seen from time to time.
class DepthTrust {
 public:
  // A depth that was measured, by the one that the images tell, and the sigma of the logarithm.
  // `as_given`: the same of the depth of the point as it was given.
  struct View {
    double log_ratio = 0, as_given = 0, sigma = 0;
  };
  using Views = std::vector<View>;
  static constexpr std::array kReadings{DepthReading{},
                                        DepthReading{.85F},
                                        DepthReading{.9F},
                                        DepthReading{.95F},
                                        DepthReading{1.05F},
                                        DepthReading{1.1F},
                                        DepthReading{1.15F},
                                        DepthReading{1, -.4},
                                        DepthReading{1, -.2},
                                        DepthReading{1, -.1},
                                        DepthReading{1, .1},
                                        DepthReading{1, .2},
                                        DepthReading{1, .4},
                                        DepthReading{1, 0, -.1},
                                        DepthReading{1, 0, -.067},
                                        DepthReading{1, 0, -.033},
                                        DepthReading{1, 0, .033},
                                        DepthReading{1, 0, .067},
                                        DepthReading{1, 0, .1},
                                        DepthReading{1, 0, .15},
                                        DepthReading{1, 0, .2},
                                        DepthReading{1, 0, .3}};
  static constexpr size_t kAsGiven = 0;
  // The longest delay.
  static constexpr double kLatest = .3;

  bool IsDue(double time_s) const;
  // The points of an image, for each reading; few or none where there is no such depth.
  void Add(double time_s, std::span<const Views> by_reading);
  // In a sentence's end; empty while there is none.
  std::string Problem() const;

 private:
  // How well a reading fits, over the images for which there is one: sums of the spread of the
  // logarithms, and of the spread of the depths as they were given.
  struct Fit {
    int images = 0;
    double spread = 0, as_given = 0;

    double Ratio() const { return spread / as_given; }
  };

  std::optional<double> judged_s_;
  int views_ = 0;
  double share_off_ = 0;  // sum over the views: of the depths that contradict the images
  std::array<Fit, kReadings.size()> fits_{};
};

}  // namespace oaslam
