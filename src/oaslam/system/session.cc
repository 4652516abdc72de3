#include "oaslam/system/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "oaslam/util/log.h"

namespace oaslam {

Session::Session(const SlamConfig& config, Map map, const NextIds& ids, bool map_is_loaded)
    : config_(config),
      pipeline_(config, std::move(map)),
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

void Session::FinishAdjustment(int frame_index) {
  MapCommand command;
  command.frame_index = frame_index;
  command.adopt_adjustment = true;
  SubmitAndWait(std::move(command));
}

void Session::ScaleToMetres(double factor, int frame_index) {
  SubmitRest();
  if (failure()) return;
  MapCommand command;
  command.frame_index = frame_index;
  command.metres_per_unit = factor;
  SubmitAndWait(std::move(command));
  if (!failure()) tracker_.Scale(factor);
}

bool Session::Join(const Map& piece, const Similarity& world_from_piece, int frame_index) {
  if (failure()) return false;
  MapCommand command;
  command.frame_index = frame_index;
  command.joining = JoiningMap{std::make_shared<const Map>(piece), world_from_piece};
  SubmitAndWait(std::move(command));
  return !failure();
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

// Tracks the frames after `first`, which has a pose, up to `last` exclusively or until tracking
// fails. Returns how many frames were tracked.
int Session::Extend(const Way& way, size_t first, size_t last, bool on_thin_evidence) {
  if (!tracker_.TakeUp(*way[first], *snapshot_, on_thin_evidence)) return 0;
  int found = 0;
  for (size_t i = first + 1; i < last; ++i, ++found) {
    std::optional<Tracker::Outcome> outcome = tracker_.Extend(*way[i], *snapshot_);
    if (!outcome) break;
    if (outcome->command) SubmitAndWait(std::move(*outcome->command));
  }
  return found;
}

// Whether a frame that has a pose gets the same pose when it is tracked from the last frame.
bool Session::AgreesWith(const Frame& frame) const {
  constexpr double kMaxDistance = 0.1, kMaxAngle = 0.05;  // of the depth; rad: drift over a gap
  Tracker tracker = tracker_;
  const std::optional<Rigid3> known = tracker.PoseOf(frame.index, *snapshot_);
  const std::optional<Tracker::Outcome> followed = tracker.Extend(frame, *snapshot_);
  if (!known || !followed) return false;
  const double distance =
      (known->OriginInSource() - followed->cam_from_world->OriginInSource()).norm();
  return distance < kMaxDistance * followed->depth &&
         known->rotation.angularDistance(followed->cam_from_world->rotation) < kMaxAngle;
}

// Tracks the frames of each gap in a copy of the session, from the last frame with a pose before
// it. Drops the result where it reaches the end of the gap and disagrees with the pose there. With
// `is_confirmed`, each frame needs less evidence, but the result must either reach the end of the
// gap and agree, or be confirmed.
int Session::FollowAlong(const Way& way, const Confirmation* is_confirmed) {
  int found = 0;
  const auto is_tracked = [&](const Frame* frame) { return tracker_.HasTracked(frame->index); };
  for (size_t i = 0; i + 1 < way.size() && !failure(); ++i) {
    if (!is_tracked(way[i]) || is_tracked(way[i + 1])) continue;
    const auto gap_end = static_cast<size_t>(
        std::find_if(way.begin() + static_cast<std::ptrdiff_t>(i) + 1, way.end(), is_tracked) -
        way.begin());
    Session trial(config_, *snapshot_, next_ids(), true);
    trial.tracker_ = tracker_;
    const int count = trial.Extend(way, i, gap_end, is_confirmed != nullptr);
    failure_ = trial.failure();
    if (failure_) return found;
    const bool has_met =
        count > 0 && i + static_cast<size_t>(count) + 1 == gap_end && gap_end < way.size();
    const auto is_right = [&] {
      if (has_met) return trial.AgreesWith(*way[gap_end]);
      return !is_confirmed || (*is_confirmed)(*trial.snapshot_, trial.tracker_.trajectory());
    };
    const bool is_believed = count > 0 && is_right();
    Log(LogLevel::kDebug, fmt::format("looking back from frame {}{}: {} frames followed{}{}",
                                      way[i]->index, is_confirmed ? " on thin evidence" : "", count,
                                      has_met ? ", to the end of the gap" : "",
                                      is_believed || count == 0 ? "" : ", not believed"));
    if (!is_believed) continue;
    found += count;
    tracker_.Learn(std::move(trial.tracker_));
    MapCommand command;
    command.frame_index = way[i]->index;
    command.successor = trial.snapshot_;
    SubmitAndWait(std::move(command));
  }
  return found;
}

int Session::LookBack(const std::vector<Frame>& frames, const Confirmation& is_confirmed) {
  SubmitRest();
  Way way;
  for (const Frame& frame : frames) way.push_back(&frame);
  int found = 0;
  for (const Confirmation* confirmation :
       {static_cast<const Confirmation*>(nullptr), &is_confirmed})
    for (int direction = 0; direction < 2; ++direction) {
      found += FollowAlong(way, confirmation);
      std::ranges::reverse(way);
    }
  return found;
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
