#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "oaslam/config.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/system/piece_link.h"
#include "oaslam/system/session.h"

namespace oaslam {

// What a lost camera does meanwhile: it makes a map of its own, whose frames are related by points,
// while each is also looked for in the old map, mostly by objects. Once enough of them are found
// there and agree, the new map's place in the old one is known much better than any single frame
// (paper, section "Application to AR": resuming SLAM).
class Resumption {
 public:
  // `empty`: a map without content, of the old one's cameras and classes.
  Resumption(const SlamConfig& config, Map empty, const NextIds& ids)
      : session_(std::make_unique<Session>(config, std::move(empty), ids, false)) {}

  // `in_old`: the frame's pose in the old map, where it was found.
  Tracker::Outcome Process(const Frame& frame, const std::optional<PoseAnchor>& in_old);
  // Of a frame that was processed before.
  void AddDetections(int frame_index, const std::vector<ObjectDetection>& detections,
                     const std::optional<PoseAnchor>& in_old);
  bool IsInitializing() const { return session_->tracker().IsInitializing(); }

  // The new map lost its camera, too, for good.
  bool IsLost(double now) const { return lost_since_ && now - *lost_since_ >= kPatience; }
  static constexpr double kPatience = 0.33;  // seconds: most losses are short

  // old_from_new, once it is well determined and the camera is followed in the new map.
  std::optional<Similarity> Locate() const;

  Session& session() { return *session_; }
  std::unique_ptr<Session> TakeSession() { return std::move(session_); }

 private:
  std::unique_ptr<Session> session_;
  std::optional<double> lost_since_;  // seconds
  PieceLink to_old_;
};

}  // namespace oaslam
