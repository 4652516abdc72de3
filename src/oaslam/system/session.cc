#include "oaslam/system/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "oaslam/util/log.h"

namespace oaslam {

Session::Session(const SlamConfig& config, Map map, const NextIds& ids, bool map_is_loaded)
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

void Session::Join(const Map& piece, const Similarity& world_from_piece, int frame_index) {
  MapCommand command;
  command.frame_index = frame_index;
  command.joining = JoiningMap{std::make_shared<const Map>(piece), world_from_piece};
  SubmitAndWait(std::move(command));
}

NextIds Session::next_ids() {
  NextIds ids = tracker_.next_ids();
  ids.landmark = Newest()->next_landmark;
  return ids;
}

void Session::SkipIds(const NextIds& ids, int frame_index) {
  tracker_.SkipIds(ids);
  MapCommand command;
  command.frame_index = frame_index;
  command.first_landmark = ids.landmark;
  SubmitAndWait(std::move(command));
}

// From each frame with a pose to those after it that have none.
int Session::FollowAlong(const std::vector<const Frame*>& frames) {
  int found = 0;
  for (size_t i = 0; i + 1 < frames.size(); ++i) {
    if (!tracker_.HasTracked(frames[i]->index) || tracker_.HasTracked(frames[i + 1]->index)) continue;
    Tracker scout = tracker_;
    if (!scout.TakeUp(*frames[i], *snapshot_)) continue;
    const int from = frames[i]->index;
    for (; i + 1 < frames.size() && !tracker_.HasTracked(frames[i + 1]->index); ++i, ++found) {
      std::optional<Tracker::Outcome> outcome = scout.Extend(*frames[i + 1], *snapshot_);
      if (!outcome) break;
      if (outcome->command) SubmitAndWait(std::move(*outcome->command));
    }
    Log(LogLevel::kDebug, fmt::format("looked back from frame {} to frame {}", from, frames[i]->index));
    tracker_.Learn(std::move(scout));
  }
  return found;
}

int Session::LookBack(const std::vector<Frame>& frames) {
  SubmitAndWait(tracker_.TakeRest());
  std::vector<const Frame*> way;
  for (const Frame& frame : frames) way.push_back(&frame);
  const int forwards = FollowAlong(way);
  std::ranges::reverse(way);
  return forwards + FollowAlong(way);
}

void Session::Finish() {
  pipeline_.Submit(tracker_.TakeRest(), true);
  snapshot_ = pipeline_.Finish();
  tracker_.SettleTrajectory(*snapshot_);
}

}  // namespace oaslam
