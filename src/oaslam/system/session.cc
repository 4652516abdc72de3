#include "oaslam/system/session.h"

#include <utility>

namespace oaslam {

Session::Session(const SlamConfig& config, Map map, const FirstIds& ids, bool map_is_loaded)
    : pipeline_(config, std::move(map)), tracker_(config, ids, map_is_loaded), snapshot_(pipeline_.Newest()) {}

Tracker::Outcome Session::Process(const Frame& frame) {
  snapshot_ = pipeline_.SnapshotFor(frame.index);
  Tracker::Outcome outcome = tracker_.Track(frame, *snapshot_);
  if (outcome.command) pipeline_.Submit(std::move(*outcome.command), outcome.map_required || outcome.is_urgent);
  if (!outcome.map_required) return outcome;
  return tracker_.AdoptInitialMap(frame, *Newest());
}

void Session::SubmitAndWait(MapCommand command) {
  pipeline_.Submit(std::move(command), true);
  Newest();
}

void Session::Finish() {
  pipeline_.Submit(tracker_.TakeRest(), true);
  snapshot_ = pipeline_.Finish();
  tracker_.SettleTrajectory(*snapshot_);
}

}  // namespace oaslam
