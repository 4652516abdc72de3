#include "oaslam/system/passed_frames.h"

namespace oaslam {
namespace {

constexpr size_t kMaxKept = 1200, kMaxRecent = 150;  // some 50 KB each

}  // namespace

void PassedFrames::Add(const Frame& frame, bool is_tracked) {
  recent_.push_back({frame, is_tracked});
  if (recent_.size() <= kMaxRecent) return;
  const Passed oldest = recent_.front();
  recent_.pop_front();
  const bool is_beside_gap = !recent_.front().is_tracked || (!kept_.empty() && !kept_.back().is_tracked);
  if (!oldest.is_tracked || is_beside_gap) kept_.push_back(oldest);
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
