#include "oaslam/system/session.h"

#include <utility>

namespace oaslam {

Session::Session(const SlamConfig& config, Map map, bool map_is_loaded)
    : pipeline_(config, std::move(map)),
      tracker_(config, map_is_loaded),
      snapshot_(pipeline_.Newest()) {}

TrackingStep Session::Process(const Frame& frame, const TrackingContext& context) {
  snapshot_ = pipeline_.SnapshotFor(frame.index);
  TrackingStep step = Submitted(tracker_.Track(frame, *snapshot_, context));
  return tracker_.AwaitsMap() ? tracker_.Begin(frame, *Newest()) : step;
}

std::optional<TrackingStep> Session::AddDetections(int frame_index,
                                                   const std::vector<ObjectDetection>& detections,
                                                   const TrackingContext& context) {
  auto step = tracker_.AddDetections(frame_index, detections, *snapshot_, context);
  return step ? std::optional(Submitted(*std::move(step))) : std::nullopt;
}

TrackingStep Session::Submitted(TrackingStep step) {
  if (step.command) pipeline_.Submit(*std::exchange(step.command, std::nullopt));
  return step;
}

void Session::SubmitAndWait(MapCommand command) {
  command.is_urgent = true;
  pipeline_.Submit(std::move(command));
  Newest();
}

void Session::Submit(MapEdit edit) {
  SubmitAndWait({.frame_index = tracker_.newest_frame(), .edit = std::move(edit)});
}

void Session::SubmitRest(MapEdit edit) {
  MapCommand rest = tracker_.TakeRest();
  rest.edit = std::move(edit);
  SubmitAndWait(std::move(rest));
}

void Session::ScaleToMetres(double factor, const std::optional<UnitEvidence>& by_objects) {
  SubmitRest();
  if (failure()) return;
  Submit(MetricScale{factor, by_objects});
  if (!failure()) tracker_.Scale(factor);
}

bool Session::Join(const Map& other, const Similarity& world_from_other) {
  Submit(JoiningMap{std::make_shared<const Map>(other), world_from_other});
  return !failure();
}

void Session::Finish(MapUse use) {
  if (use == MapUse::kRead) {
    Newest();
  } else {
    SubmitRest();
    snapshot_ = pipeline_.Finish();
  }
  tracker_.RefineTrajectory(*snapshot_);
}

}  // namespace oaslam
