#include "oaslam/map/later_poses.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "oaslam/util/median.h"

namespace oaslam {

Similarity MotionToEarlier(const Map& now, const Map& earlier, KeyframeId about) {
  constexpr int kGroup = 10;
  std::vector<KeyframeId> group = earlier.CovisibleKeyframes(about, kGroup);
  group.push_back(about);
  std::vector<double> ratios;
  for (const KeyframeId id : group) {
    const Keyframe *was = earlier.keyframes.Find(id), *is = now.keyframes.Find(id);
    if (!was || !is || was->features != is->features) continue;
    for (size_t i = 0; i < was->landmarks.size(); ++i)
      if (was->landmarks[i].IsValid() && is->landmarks[i].IsValid())
        ratios.push_back(
            (was->cam_from_world * earlier.landmarks.At(was->landmarks[i]).position).norm() /
            (is->cam_from_world * now.landmarks.At(is->landmarks[i]).position).norm());
  }
  const double scale = ratios.empty() ? 1 : Median(std::move(ratios));
  return Similarity(earlier.ResolvePose(about)->Inverse()) *
         Similarity(scale, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()) *
         Similarity(*now.ResolvePose(about));
}

const LaterPoses::Carrier& LaterPoses::CarrierOf(int frame_index) const {
  const auto after = std::ranges::upper_bound(carriers, frame_index, {}, &Carrier::frame_index);
  return after == carriers.begin() ? carriers.front() : *std::prev(after);
}

void LaterPoses::Restore(int frame_index, KeyframeId& reference, Rigid3& cam_from_reference) const {
  if (frame_index <= carriers.front().frame_index) return;
  const auto reference_pose = bent->ResolvePose(reference);
  if (!reference_pose) return;
  const auto own = std::ranges::find(carriers, reference, &Carrier::id);
  const Carrier& carrier = own != carriers.end() ? *own : CarrierOf(frame_index);
  cam_from_reference = cam_from_reference * *reference_pose * carrier.cam_from_world.Inverse();
  cam_from_reference.translation *= carrier.scale;
  reference = carrier.id;
}

}  // namespace oaslam
