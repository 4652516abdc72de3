#include "oaslam/mapping/keyframe_description.h"

#include <memory>
#include <utility>

#include "oaslam/description/describe_features.h"
#include "oaslam/mapping/local_mapping.h"

namespace oaslam {

bool DescribeKeyframe(KeyframeId id, Map& map) {
  if (!map.keyframes.At(id).image) return false;
  PointsToDescribe points = FindPointsToDescribe(id, map);
  Keyframe& keyframe = map.keyframes.MutableAt(id);
  keyframe.features = std::make_shared<const Features>(
      DescribeFeatures(*keyframe.features, map.cameras[static_cast<size_t>(keyframe.camera)],
                       keyframe.image->view(), points.keypoints));
  keyframe.learned_depths = std::move(points.depths);
  keyframe.image.reset();
  return true;
}

void DescribeKeyframes(Map& map) {
  for (const KeyframeId id : map.keyframes.Ids()) DescribeKeyframe(id, map);
}

}  // namespace oaslam
