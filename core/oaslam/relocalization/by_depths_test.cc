#include "oaslam/relocalization/by_depths.h"

#include <gtest/gtest.h>

#include <memory>

#include "cameras.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

constexpr double kWall = 2;  // from the camera, m

// A camera that looks at a wall, and a map of the wall in metres.
class ByDepthsTest : public testing::Test {
 protected:
  ByDepthsTest() {
    frame_.camera = std::make_shared<const Camera>(synthetic::kCamera);
    frame_.depth = std::make_shared<const DepthMap>(
        160, 120, std::vector<float>(size_t{160} * 120, kWall), 640, 480, .002, .002);
    Rng rng(1);
    for (uint32_t i = 0; i < 300; ++i) {
      Landmark landmark;
      landmark.position =
          kWall * RayOf(synthetic::kCamera, {rng.Uniform(5, 635), rng.Uniform(5, 475)});
      map_.landmarks.Insert(LandmarkId(i), std::move(landmark));
    }
    map_.is_metric = true;
  }
  static Relocalization FoundAt(double back, double sigma, double confidence, int points) {
    Relocalization found;
    found.cam_from_world.translation.z() = back;
    found.covariance = ExpectedPose{{}, sigma, .02}.Covariance();
    found.evidence = points > 0 ? PoseEvidence::kPoints : PoseEvidence::kObjects;
    found.confidence = confidence;
    found.points.inliers = points;
    return found;
  }

  Frame frame_;
  Map map_;
};

TEST_F(ByDepthsTest, AnUncertainPoseGetsTheDistanceThatWasMeasured) {
  Relocalization found = FoundAt(.1, .1, .98, 0);
  ApplyDepths(frame_, map_, found);
  EXPECT_TRUE(found.IsFound());
  EXPECT_NEAR(found.cam_from_world.translation.z(), 0, .02);
  Map other_unit = map_;
  other_unit.is_metric = false;
  found = FoundAt(.1, .1, .98, 0);
  ApplyDepths(frame_, other_unit, found);
  EXPECT_EQ(found.cam_from_world.translation.z(), .1);
}

TEST_F(ByDepthsTest, APoseWhoseLandmarksAreSeenThroughIsRefused) {
  Relocalization found = FoundAt(-.8, .02, .98, 0);
  ApplyDepths(frame_, map_, found);
  EXPECT_FALSE(found.IsFound());
  EXPECT_LT(found.confidence, .5);
  EXPECT_NE(found.why_not.find("sees through "), std::string::npos) << found.why_not;
}

TEST_F(ByDepthsTest, ManyPointsOutvoteDepthsOfThingsThatWereRemoved) {
  Relocalization found = FoundAt(-.8, .001, .9999, 200);
  ApplyDepths(frame_, map_, found);
  EXPECT_TRUE(found.IsFound());
}

}  // namespace
}  // namespace oaslam
