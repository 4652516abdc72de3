#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace oaslam {

// The times of images on a topic. SLAM needs ascending times; those of a bag that is played in a
// loop (`use_sim_time`) go back. From there on a constant is added, so that the next image is a
// second later than the last. Stamps are nanoseconds; 0 is none.
class ImageClock {
 public:
  enum class Step {
    kNext,    // later than the last
    kBack,    // more than a second earlier: the clock began anew
    kNotNew,  // not later than the last: to be left out
    kNone     // without a stamp: to be left out
  };
  Step Add(int64_t stamp);
  // Seconds that ascend, of a stamp in the present pass of the clock.
  double Seconds(int64_t stamp) const;
  // The reverse, of any pass.
  int64_t StampOf(double seconds) const;
  int64_t newest() const { return last_.value_or(0); }
  // How many images did not arrive, by the gaps between the others. A gap of more than 2 s is a
  // pause.
  int missed() const { return missed_; }

 private:
  struct Pass {
    double begin_s = 0;  // Seconds of its first image
    int64_t added = 0;   // nanoseconds
  };
  void CountMissed(int64_t interval);
  double UsualInterval() const;

  std::vector<Pass> passes_;
  std::optional<int64_t> last_;  // stamp
  std::deque<int64_t> intervals_;
  int missed_ = 0;
  double gap_ = 0;  // before the last image, in usual intervals; 0: none
};

}  // namespace oaslam
