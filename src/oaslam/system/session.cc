#include "oaslam/system/session.h"

#include <utility>

namespace oaslam {

Session::Session(const SlamConfig& config, Map map, const NextIds& ids, bool map_is_loaded)
    : pipeline_(config, std::move(map)),
      tracker_(config, ids, map_is_loaded),
      snapshot_(pipeline_.Newest()) {}

Tracker::Outcome Session::Process(const Frame& frame) {
  snapshot_ = pipeline_.SnapshotFor(frame.index);
  Tracker::Outcome outcome = Submitted(tracker_.Track(frame, *snapshot_));
  return outcome.map_required ? tracker_.AdoptInitialMap(frame, *Newest()) : outcome;
}

std::optional<Tracker::Outcome> Session::AddDetections(
    int frame_index, const std::vector<ObjectDetection>& detections) {
  auto outcome = tracker_.AddDetections(frame_index, detections, *snapshot_);
  return outcome ? std::optional(Submitted(*std::move(outcome))) : std::nullopt;
}

Tracker::Outcome Session::Submitted(Tracker::Outcome outcome) {
  if (outcome.command)
    pipeline_.Submit(std::move(*outcome.command), outcome.map_required || outcome.is_urgent);
  return outcome;
}

void Session::Submit(MapEdit edit) {
  pipeline_.Submit({tracker_.newest_frame(), std::move(edit)}, true);
  Newest();
}

void Session::SubmitRest(MapEdit edit) {
  MapCommand rest = tracker_.TakeRest();
  rest.edit = std::move(edit);
  pipeline_.Submit(std::move(rest), true);
  Newest();
}

void Session::ScaleToMetres(double factor) {
  SubmitRest();
  if (failure()) return;
  Submit(MetricScale{factor});
  if (!failure()) tracker_.Scale(factor);
}

bool Session::Join(const Map& piece, const Similarity& world_from_piece) {
  Submit(JoiningMap{std::make_shared<const Map>(piece), world_from_piece});
  return !failure();
}

void Session::Finish() {
  if (tracker_.IsMapping()) {
    SubmitRest();
    snapshot_ = pipeline_.Finish();
  } else {
    Newest();
  }
  tracker_.RefineTrajectory(*snapshot_);
}

}  // namespace oaslam
