#include "oaslam/system/passed_frames.h"

#include <algorithm>

namespace oaslam {
namespace {

constexpr size_t kMaxKept = 1200, kMaxRecent = 150;  // frames of about 50 KB, 60 MB in all
// Frames kept on either side of a gap, 1 s at 30 Hz: they may have poses in two pieces and link
// them.
constexpr int kBeside = 30;

}  // namespace

void PassedFrames::Add(const Frame& frame, bool is_tracked) {
  recent_.push_back({frame, is_tracked});
  if (recent_.size() <= kMaxRecent) return;
  const Passed oldest = recent_.front();
  recent_.pop_front();
  if (!oldest.is_tracked) last_lost_ = oldest.frame.index;
  const auto next = recent_.begin() + std::min<std::ptrdiff_t>(kBeside, std::ssize(recent_));
  const bool is_before_gap =
      std::any_of(recent_.begin(), next, [](const Passed& passed) { return !passed.is_tracked; });
  const bool is_behind_gap = last_lost_ && oldest.frame.index - *last_lost_ <= kBeside;
  if (is_before_gap || is_behind_gap) kept_.push_back(oldest);
  if (kept_.size() > kMaxKept) kept_.pop_front();
}

std::vector<Frame> PassedFrames::All() const {
  std::vector<Frame> frames;
  for (const auto* part : {&kept_, &recent_})
    for (const Passed& passed : *part) frames.push_back(passed.frame);
  return frames;
}

void PassedFrames::Clear() {
  kept_.clear();
  recent_.clear();
}

}  // namespace oaslam
