#include "oaslam/system/session.h"

#include <utility>

namespace oaslam {

Session::Session(const SlamConfig& config, Map map, const NextIds& ids, bool map_is_loaded)
    : pipeline_(config, std::move(map)),
      tracker_(config, ids, map_is_loaded),
      snapshot_(pipeline_.Newest()) {}

Tracker::Outcome Session::Process(const Frame& frame) {
  snapshot_ = pipeline_.SnapshotFor(frame.index);
  Tracker::Outcome outcome = tracker_.Track(frame, *snapshot_);
  if (outcome.command)
    pipeline_.Submit(std::move(*outcome.command), outcome.map_required || outcome.is_urgent);
  if (!outcome.map_required) return outcome;
  return tracker_.AdoptInitialMap(frame, *Newest());
}

void Session::SubmitRest() { SubmitAndWait(tracker_.TakeRest()); }

void Session::SubmitAndWait(MapCommand command) {
  pipeline_.Submit(std::move(command), true);
  Newest();
}

void Session::FinishAdjustment(int frame_index) { SubmitAndWait({frame_index, AdoptAdjustment{}}); }

void Session::ScaleToMetres(double factor, int frame_index) {
  SubmitRest();
  if (failure()) return;
  SubmitAndWait({frame_index, MetricScale{factor}});
  if (!failure()) tracker_.Scale(factor);
}

bool Session::Join(const Map& piece, const Similarity& world_from_piece, int frame_index) {
  if (failure()) return false;
  SubmitAndWait({frame_index, JoiningMap{std::make_shared<const Map>(piece), world_from_piece}});
  return !failure();
}

NextIds Session::next_ids() {
  NextIds ids = tracker_.next_ids();
  ids.landmark = Newest()->next_landmark;
  return ids;
}

void Session::SkipIds(const NextIds& ids, int frame_index) {
  tracker_.SkipIds(ids);
  SubmitAndWait({frame_index, SkipLandmarks{ids.landmark}});
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
