#include "oaslam/viewer/path.h"

#include "oaslam/viewer/map_delta.h"

namespace oaslam {

void Path::Add(const FramePose& pose, const Map& map) {
  const std::optional<Rigid3> reference = map.ResolvePose(pose.reference);
  poses_.push_back(pose);
  points_.push_back(
      reference ? Point{PoseNumbers((pose.cam_from_reference * *reference).Inverse()), ++version_}
                : Point{});
}

void Path::Replace(const std::vector<FramePose>& poses, const Map& map) {
  Clear();
  for (const FramePose& pose : poses) Add(pose, map);
}

void Path::Update(const Map& map) {
  ++version_;
  KeyframeId known;
  std::optional<Rigid3> reference;
  for (size_t i = 0; i < poses_.size(); ++i) {
    if (poses_[i].reference != known || !reference)
      reference = map.ResolvePose(known = poses_[i].reference);
    if (!reference) continue;
    const std::array<float, 7> now =
        PoseNumbers((poses_[i].cam_from_reference * *reference).Inverse());
    if (points_[i].changed == 0 || now != points_[i].world_from_cam) points_[i] = {now, version_};
  }
}

void Path::Clear() {
  poses_.clear();
  points_.clear();
  begun_ = ++version_;
}

uint64_t Path::AddDelta(uint64_t version, MessageBuilder& message) const {
  if (version == version_) return version_;
  std::vector<uint32_t> places, frames;
  std::vector<float> poses;
  std::vector<uint8_t> states;
  for (size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].changed == 0 || (points_[i].changed <= version && version >= begun_)) continue;
    places.push_back(static_cast<uint32_t>(i));
    frames.push_back(static_cast<uint32_t>(poses_[i].frame_index));
    poses.insert(poses.end(), points_[i].world_from_cam.begin(), points_[i].world_from_cam.end());
    states.push_back(static_cast<uint8_t>(poses_[i].state));
  }
  message.header["path_size"] = points_.size();
  message.Add("path_places", places);
  message.Add("path_frames", frames);
  message.Add("path_poses", poses);
  message.Add("path_states", states);
  return version_;
}

}  // namespace oaslam
