#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "oaslam/config.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/pieces/piece_link.h"
#include "oaslam/system/session.h"

namespace oaslam {

// A new map in which the camera is tracked by points while it is lost in the old one. It is also
// looked for in the old map, mostly by objects. Once enough frames are found there and agree, the
// transformation between the maps is known much better than the pose of any single frame (paper,
// section "Application to AR": resuming SLAM).
class GrowingPiece {
 public:
  // `empty`: a map without content, with the cameras and class relations of the old one.
  GrowingPiece(const SlamConfig& config, Map empty, const NextIds& ids)
      : session_(std::make_unique<Session>(config, std::move(empty), ids, false)) {}

  // `in_old`: the frame's pose in the old map, where it was found.
  Tracker::Outcome Process(const Frame& frame, const std::optional<LocatedPose>& in_old);
  // Detections of a frame that was processed before, and its pose in the old
  // map where they gave one.
  void AddDetections(int frame_index, const std::vector<ObjectDetection>& detections,
                     const std::optional<LocatedPose>& in_old);
  bool IsInitializing() const { return session_->tracker().IsInitializing(); }

  // Whether the camera has also been lost in the new map for longer than kPatience.
  bool IsLost(double now) const { return lost_since_ && now - *lost_since_ >= kPatience; }
  static constexpr double kPatience = 0.33;  // seconds; most losses are shorter

  // The transformation between the maps (PieceLink::Align), once it is well determined and while
  // the camera is tracked in the new map.
  std::optional<PieceAlignment> Align() const;

  Session& session() { return *session_; }
  std::unique_ptr<Session> TakeSession() { return std::move(session_); }

 private:
  std::unique_ptr<Session> session_;
  std::optional<double> lost_since_;  // time stamp, seconds
  PieceLink to_old_;
};

}  // namespace oaslam
