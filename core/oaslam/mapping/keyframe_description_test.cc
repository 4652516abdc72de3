#include "oaslam/mapping/keyframe_description.h"

#include <gtest/gtest.h>

#include "grey_scene.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

TEST(DescribeKeyframes, ThoseWithAnImageGetDescriptorsForIt) {
  Map map = synthetic::MakeMap(synthetic::MakeWorld({.points = 300, .cameras = 4}), {}).map;
  const auto image = std::make_shared<const GreyBuffer>(synthetic::RandomScene(640, 480, 1));
  map.keyframes.MutableAt(KeyframeId(1)).image = image;
  map.keyframes.MutableAt(KeyframeId(2)).image = image;
  EXPECT_FALSE(DescribeKeyframe(KeyframeId(0), map));
  EXPECT_TRUE(DescribeKeyframe(KeyframeId(1), map));
  EXPECT_FALSE(DescribeKeyframe(KeyframeId(1), map));
  EXPECT_TRUE(map.keyframes.At(KeyframeId(2)).image);
  DescribeKeyframes(map);
  map.keyframes.ForEach([](KeyframeId id, const Keyframe& keyframe) {
    const bool has_image = id == KeyframeId(1) || id == KeyframeId(2);
    EXPECT_FALSE(keyframe.image);
    EXPECT_EQ(!keyframe.features->learned.empty(), has_image) << id.value;
    EXPECT_EQ(keyframe.learned_depths.size(), keyframe.features->learned.keypoints.size());
  });
}

}  // namespace
}  // namespace oaslam
