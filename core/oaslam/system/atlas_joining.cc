// How the submaps of an atlas are joined.

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "oaslam/map/renumbering.h"
#include "oaslam/mapping/submap_joining.h"
#include "oaslam/system/atlas.h"
#include "oaslam/system/keyframe_search.h"
#include "oaslam/tracking/continuity.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Of the map in which the camera is tracked, where another is joined with it: smaller ones have
// hardly any parallax.
constexpr size_t kMinKeyframes = 5;

void SayJoined(int frame, const Submap& joined, const SubmapAlignment& alignment) {
  std::vector<int> frames;
  joined.map.keyframes.ForEach(
      [&](KeyframeId, const Keyframe& keyframe) { frames.push_back(keyframe.frame_index); });
  const auto [first, last] = std::ranges::minmax(frames);
  Log(LogLevel::kInfo,
      "frame {}: a submap of {} keyframes, frames {} to {}, was joined: {} images by points and {} "
      "by objects agree, {} do not; scale known to {:.1f} %",
      frame, frames.size(), first, last, alignment.by_points, alignment.by_objects,
      alignment.contradicting, 100 * alignment.relative_sigma);
}

// Joins another submap with the map of a session; false where the camera would jump between them.
// `alignment`: from the other one to the session's.
bool Join(const Submap& other, const SubmapAlignment& alignment, Session& session) {
  if (!IsContinuous(*session.snapshot(), session.tracker().trajectory(), other.map,
                    other.trajectory, alignment.other_from_this) ||
      !session.Join(other.map, alignment.other_from_this))
    return false;
  SayJoined(session.tracker().newest_frame(), other, alignment);
  return true;
}

}  // namespace

// Joins the growing submap with the main one, in which a camera that is lost there is then tracked
// as it was in the growing one. Returns false, and leaves the submaps as they are, where the
// transformation is not known yet, the camera is lost or would jump, or the mapping of the main
// submap has failed.
bool Atlas::JoinGrowing() {
  Session& session = growing_->session();
  if (growing_->lost_since || session.snapshot()->keyframes.size() < kMinKeyframes) return false;
  const auto align = [&] {
    return growing_->to_main.Align(*session.snapshot(), session.tracker().trajectory());
  };
  // First on the map that the tracker saw, since the newest one must be waited for, and may have
  // moved.
  if (!align()) return false;
  const Submap content{*session.Newest(), session.tracker().trajectory()};
  const std::optional<SubmapAlignment> alignment = align();
  if (!alignment || !Join(content, *alignment, main())) return false;
  if (!failure_) failure_ = session.failure();
  main().tracker().GoOnAs(std::move(session.tracker()), alignment->other_from_this.scale);
  if (growing_->metre && !main().snapshot()->is_metric)
    metre_ = Metre{growing_->metre->metres_per_unit / alignment->other_from_this.scale,
                   growing_->metre->by_objects};
  AtlasSubmap& joined = *std::exchange(growing_, std::nullopt)->submap;
  joinings_[joined.number] = {main_->number, alignment->other_from_this};
  main_->next_keyframe = std::max(main_->next_keyframe, joined.next_keyframe);
  End(std::move(joined.session));
  Erase(joined);
  return true;
}

// Looks for a keyframe of a session in the waiting submaps, in turn. The camera still sees some of
// the submap that was left last: there, both keyframes of a map that begins are looked for, and
// each second one while that grows.
void Atlas::LookFrom(const Frame& keyframe, AtlasSubmap& in) {
  const std::vector<AtlasSubmap*> waiting = Waiting();
  if (waiting.empty()) return;
  const std::shared_ptr<const Map> map = in.session->snapshot();
  const std::vector<KeyframeId> ids = map->keyframes.Ids();
  const bool begins = ids.size() == 2 && map->keyframes.At(ids[1]).frame_index == keyframe.index;
  const size_t turn = turn_++;
  if (begins)
    for (const KeyframeId id : ids) LookFor(FrameOf(*map, id), in, *waiting.back());
  else if (&in != main_ && turn % 2 == 0)
    LookFor(keyframe, in, *waiting.back());
  else
    LookFor(keyframe, in, *waiting[turn / 2 % waiting.size()]);
}

// Looks for a keyframe of a session in a waiting submap, and joins that with the session's map once
// its place is known.
void Atlas::LookFor(const Frame& keyframe, AtlasSubmap& in, AtlasSubmap& waiting) {
  Session& session = *in.session;
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const Map& other = waiting.content.map;
  const Relocalization found = waiting.relocalizer.Find(keyframe, other, mode_, rng);
  const double seconds = keyframe.timestamp - waiting.seen_at;
  if (found.IsFound() && TellsPlace(other, *session.snapshot(), found, seconds))
    waiting.link.AddKeyframe(keyframe.index, found, other, seconds <= kLongestStep);
  if (session.snapshot()->keyframes.size() < kMinKeyframes) return;
  const auto align = [&] {
    return waiting.link.Align(*session.snapshot(), session.tracker().trajectory());
  };
  if (!align()) return;
  session.Submit(AdoptAdjustment{});  // queued commands may still move the map
  const auto waiting_from_world = align();
  if (!waiting_from_world) return;
  const SubmapAlignment world_from_waiting = waiting_from_world->Inverse();
  if (lost_since_ && &in != main_ && !MustStayMain()) {
    // Asked before the main submap is exchanged; JoinWaiting asks by itself.
    if (IsContinuous(*session.snapshot(), session.tracker().trajectory(), other,
                     waiting.content.trajectory, world_from_waiting.other_from_this))
      GoBackTo(waiting);
  } else if (JoinWaiting(waiting, world_from_waiting, in)) {
    Erase(waiting);
  }
}

// The camera is lost in the main submap, and the growing one has met one that waits: that one
// becomes the main one again, in its own frame, and the growing one is joined with it.
void Atlas::GoBackTo(AtlasSubmap& waiting) {
  growing_->to_main = std::exchange(waiting.link, {});
  AtlasSubmap& left = *main_;
  Wake(waiting);
  Lead(waiting);
  Rest(left);
  if (!JoinGrowing()) EndGrowing();
}

bool Atlas::JoinWaiting(const AtlasSubmap& waiting, const SubmapAlignment& world_from_waiting,
                        AtlasSubmap& into) {
  Session& session = *into.session;
  const NextIds free{into.next_keyframe, session.Newest()->next_landmark, next_object_};
  const Submap joining = Renumbered(waiting.content, free);
  const std::optional<Metre> metre =
      MetreBy(joining.map, world_from_waiting.other_from_this, *session.snapshot());
  if (!Join(joining, world_from_waiting, session)) return false;
  if (metre) (&into == main_ ? metre_ : growing_->metre) = metre;
  const NextIds next = NextIdsOf(joining.map);
  into.next_keyframe = std::max(into.next_keyframe, next.keyframe);
  next_object_ = std::max(next_object_, next.object);
  session.tracker().Adopt(joining.trajectory, world_from_waiting.other_from_this.scale);
  joinings_[waiting.number] = {into.number, world_from_waiting.other_from_this};
  return true;
}

bool Atlas::JoinWaiting(const AtlasSubmap& waiting, AtlasSubmap& into) {
  auto& [map, trajectory] = into.content;
  const Submap& other = waiting.content;
  const auto world_from_other = PlaceIn(map, trajectory, waiting, into.relocalizer);
  if (!world_from_other || !IsContinuous(map, trajectory, other.map, other.trajectory,
                                         world_from_other->other_from_this))
    return false;
  const Submap joining = Renumbered(other, NextIdsOf(map));
  const std::optional<Metre> metre = MetreBy(joining.map, world_from_other->other_from_this, map);
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  JoinSubmap(joining.map, world_from_other->other_from_this, config_, rng, map);
  AdoptPoses(joining.trajectory, world_from_other->other_from_this.scale, trajectory);
  ++map.version;
  joinings_[waiting.number] = {into.number, world_from_other->other_from_this};
  if (metre) {
    ScaleToMetres(metre->metres_per_unit, metre->by_objects, map, trajectory);
    ScaleJoinings(into.number, metre->metres_per_unit);
    into.link = {};  // its poses have the former unit
  }
  SayJoined(main().tracker().newest_frame(), joining, *world_from_other);
  return true;
}

// After the lengths of a submap were multiplied.
void Atlas::ScaleJoinings(int into, double factor) {
  for (auto& [number, joining] : joinings_)
    if (joining.into == into)
      joining.into_from_joined =
          Similarity(factor, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()) *
          joining.into_from_joined;
}

std::map<int, Similarity> Atlas::Joined() const {
  std::map<int, Similarity> joined;
  for (const auto& [number, joining] : joinings_) {
    Similarity from_joined = joining.into_from_joined;
    int into = joining.into;
    for (auto next = joinings_.find(into); next != joinings_.end(); next = joinings_.find(into)) {
      from_joined = next->second.into_from_joined * from_joined;
      into = next->second.into;
    }
    if (into == main_->number) joined.emplace(number, from_joined);
  }
  return joined;
}

// The place of a waiting submap in another map: by its keyframes that are found there, or by frames
// of the other one that were found in it.
std::optional<SubmapAlignment> Atlas::PlaceIn(const Map& world,
                                              const std::vector<FramePose>& trajectory,
                                              const AtlasSubmap& waiting,
                                              Relocalizer& relocalizer) const {
  const auto& [map, own_trajectory] = waiting.content;
  SubmapLink link;
  FindKeyframes(waiting.content, world, mode_, {}, config_, relocalizer, link);
  if (auto found = link.Align(map, own_trajectory)) return found;
  const auto seen = waiting.link.Align(world, trajectory);
  return seen ? std::optional(seen->Inverse()) : std::nullopt;
}

// Joins waiting submaps with the main one and with each other.
void Atlas::JoinAll() {
  std::vector<AtlasSubmap*> waiting = Waiting();
  std::ranges::stable_sort(waiting, std::greater(), &AtlasSubmap::keyframes);
  // After each one anew, since more may be found in what has become larger.
  const auto join_all = [&](size_t first, const auto& join) {
    const auto next = [&] {
      return std::find_if(waiting.begin() + static_cast<std::ptrdiff_t>(first), waiting.end(),
                          [&](const AtlasSubmap* submap) { return join(*submap); });
    };
    for (auto joined = next(); joined != waiting.end(); joined = next()) {
      Erase(**joined);
      waiting.erase(joined);
    }
  };
  Relocalizer relocalizer(config_);
  join_all(0, [&](const AtlasSubmap& submap) {
    const auto world_from_submap =
        PlaceIn(*main().snapshot(), main().tracker().trajectory(), submap, relocalizer);
    return world_from_submap && JoinWaiting(submap, *world_from_submap, *main_);
  });
  for (size_t i = 0; i < waiting.size(); ++i)
    join_all(i + 1, [&](const AtlasSubmap& submap) { return JoinWaiting(submap, *waiting[i]); });
}

}  // namespace oaslam
