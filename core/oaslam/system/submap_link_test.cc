#include "oaslam/system/submap_link.h"

#include <gtest/gtest.h>

#include <vector>

#include "synthetic_world.h"

namespace oaslam {
namespace {

// A submap, and another one of the same scene in another unit.
class SubmapLinkTest : public testing::Test {
 protected:
  static constexpr double kScale = 2.5;

  SubmapLinkTest() { other_.Scale(kScale); }

  // Where a keyframe of the submap was found in the other one. It has the same ids there.
  Relocalization FoundInOther(KeyframeId id) const {
    const Keyframe& keyframe = other_.keyframes.At(id);
    Relocalization found;
    found.evidence = PoseEvidence::kPoints;
    found.cam_from_world = keyframe.cam_from_world;
    found.covariance = 1e-4 * PoseCovariance::Identity();
    found.points.landmarks = keyframe.landmarks;
    return found;
  }

  // The link by the first keyframes.
  SubmapLink LinkBy(uint32_t count, bool is_soon = true) const {
    SubmapLink link;
    for (uint32_t k = 0; k < count; ++k)
      link.AddKeyframe(map_.keyframes.At(KeyframeId(k)).frame_index, FoundInOther(KeyframeId(k)),
                       other_, is_soon);
    return link;
  }

  std::vector<FramePose> Trajectory() const {
    std::vector<FramePose> poses;
    map_.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
      poses.push_back({keyframe.frame_index, keyframe.timestamp, id, {}});
    });
    return poses;
  }

  Map map_ = synthetic::MakeMap(synthetic::MakeWorld({}), {}).map, other_ = map_;
};

TEST_F(SubmapLinkTest, TwoKeyframesTellTheScaleByPointsThatBothSubmapsHave) {
  const auto alignment = LinkBy(2).Align(map_, Trajectory());
  ASSERT_TRUE(alignment);
  EXPECT_NEAR(alignment->other_from_this.scale, kScale, 0.02 * kScale);
  EXPECT_LT(alignment->relative_sigma, 0.02);
  EXPECT_EQ(alignment->by_points, 2);
}

TEST_F(SubmapLinkTest, TwoKeyframesAreNotEnoughWhereAThirdContradicts) {
  Relocalization wrong = FoundInOther(KeyframeId(3));
  wrong.cam_from_world.translation += Eigen::Vector3d(4, 0, 2);
  for (const uint32_t right : {2U, 3U}) {
    SubmapLink link = LinkBy(right);
    link.AddKeyframe(map_.keyframes.At(KeyframeId(3)).frame_index, wrong, other_, true);
    const auto alignment = link.Align(map_, Trajectory());
    EXPECT_EQ(alignment.has_value(), right == 3);
    if (alignment) {
      EXPECT_EQ(alignment->contradicting, 1);
    }
  }
}

TEST_F(SubmapLinkTest, LongAfterTheCameraWasThereTwoKeyframesAreNotEnough) {
  EXPECT_FALSE(LinkBy(2, false).Align(map_, Trajectory()));
  EXPECT_TRUE(LinkBy(4, false).Align(map_, Trajectory()));
}

TEST_F(SubmapLinkTest, OneKeyframeIsNotEnough) {
  EXPECT_FALSE(LinkBy(1).Align(map_, Trajectory()));
}

TEST_F(SubmapLinkTest, WithoutSuchPointsTwoKeyframesAreNotEnough) {
  for (const KeyframeId id : map_.keyframes.Ids())
    for (LandmarkId& landmark : map_.keyframes.MutableAt(id).landmarks) landmark = {};
  EXPECT_FALSE(LinkBy(2).Align(map_, Trajectory()));
  EXPECT_TRUE(LinkBy(4).Align(map_, Trajectory()));
}

}  // namespace
}  // namespace oaslam
