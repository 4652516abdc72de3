#include <algorithm>
#include <optional>
#include <utility>

#include "oaslam/storage/map_file.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

int FramesOf(const SavedMap& saved) {
  int last = -1;
  const auto count = [&](const Map& map, const std::vector<FramePose>& trajectory) {
    map.keyframes.ForEach(
        [&](KeyframeId, const Keyframe& k) { last = std::max(last, k.frame_index); });
    map.objects.ForEach(
        [&](ObjectId, const Object& o) { last = std::max(last, o.last_seen_frame); });
    for (const FramePose& pose : trajectory) last = std::max(last, pose.frame_index);
  };
  count(saved.map, saved.trajectory);
  for (const Submap& submap : saved.submaps) count(submap.map, submap.trajectory);
  return last + 1;
}

std::vector<StampedPose> WorldPoses(const Map& map, const std::vector<FramePose>& frames,
                                    int first_frame) {
  std::vector<StampedPose> poses;
  for (const FramePose& frame : frames)
    if (const auto reference =
            frame.frame_index < first_frame ? std::nullopt : map.ResolvePose(frame.reference))
      poses.push_back({frame.timestamp, (frame.cam_from_reference * *reference).Inverse()});
  return poses;
}

std::vector<StampedPose> KeyframePoses(const Map& map, int first_frame) {
  std::vector<StampedPose> poses;
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& k) {
    if (k.frame_index >= first_frame) poses.push_back({k.timestamp, k.cam_from_world.Inverse()});
  });
  std::ranges::stable_sort(poses, {}, &StampedPose::timestamp);
  return poses;
}

void LeadWithSubmap(const std::string& path, int submap, SavedMap& saved) {
  const int count = static_cast<int>(saved.submaps.size());
  if (submap < 0 || submap > count)
    throw BadInput("{}: there is no submap {}, allowed: 0 to {}", path, submap, count);
  if (submap == 0) return;
  Submap& chosen = saved.submaps[static_cast<size_t>(submap) - 1];
  std::swap(chosen.map, saved.map);
  std::swap(chosen.trajectory, saved.trajectory);
}

}  // namespace oaslam
