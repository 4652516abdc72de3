#include "oaslam/system/growing_piece.h"

namespace oaslam {

Tracker::Outcome GrowingPiece::Process(const Frame& frame,
                                       const std::optional<LocatedPose>& in_old) {
  Tracker::Outcome outcome = session_->Process(frame);
  const bool is_lost =
      outcome.state == TrackingState::kLost || outcome.state == TrackingState::kObjects;
  if (!is_lost)
    lost_since_.reset();
  else if (!lost_since_)
    lost_since_ = frame.timestamp;
  if (in_old) to_old_.Add(frame.index, *in_old);
  return outcome;
}

void GrowingPiece::AddDetections(int frame_index, const std::vector<ObjectDetection>& detections,
                                 const std::optional<LocatedPose>& in_old) {
  session_->AddDetections(frame_index, detections);
  if (in_old) to_old_.Add(frame_index, *in_old);
}

std::optional<PieceAlignment> GrowingPiece::Align() const {
  constexpr size_t kMinKeyframes = 5;  // smaller maps have hardly any parallax
  const Map& map = *session_->snapshot();
  if (lost_since_ || map.keyframes.size() < kMinKeyframes) return std::nullopt;
  return to_old_.Align(map, session_->tracker().trajectory());
}

}  // namespace oaslam
