#include "oaslam/estimation/motion_filter.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

const MotionFilter::Matrix6 kSure = 1e-6 * MotionFilter::Matrix6::Identity();

PoseVector Step(double forward, double turn) {
  PoseVector step = PoseVector::Zero();
  step[2] = -forward;
  step[4] = turn;
  return step;
}

TEST(MotionFilter, GoesOnAsItHasMoved) {
  constexpr double kInterval = 0.05;
  const PoseVector step = Step(0.02, 0.01);
  Rigid3 pose = Moved(Rigid3(), Step(1, 0.5));
  MotionFilter filter(pose, kSure, 2);
  for (int i = 0; i < 10; ++i) {
    filter.Predict(kInterval);
    pose = Moved(pose, step);
    filter.Correct(pose, kSure);
  }
  filter.Predict(4 * kInterval);
  const Rigid3 ahead = Moved(pose, 4 * step);
  EXPECT_LT((filter.cam_from_world().translation - ahead.translation).norm(), 0.004);
  EXPECT_LT(filter.cam_from_world().rotation.angularDistance(ahead.rotation), 0.003);
}

TEST(MotionFilter, BecomesUnsureWithoutImages) {
  MotionFilter filter(Rigid3(), kSure, 2);
  filter.Predict(0.1);
  const MotionFilter::Matrix6 soon = filter.covariance();
  filter.Predict(0.9);
  const MotionFilter::Matrix6 later = filter.covariance();
  // Within a second a camera 2 m away may move by a metre, and turn by a radian.
  EXPECT_NEAR(std::sqrt(soon(0, 0)), 0.1, 0.01);
  EXPECT_NEAR(std::sqrt(later(0, 0)), 1, 0.2);
  EXPECT_NEAR(std::sqrt(later(5, 5)), 1, 0.2);
  EXPECT_TRUE(later.isApprox(later.transpose()));
}

TEST(MotionFilter, APoseThatIsHardlyKnownTellsLittleOfTheVelocity) {
  MotionFilter filter(Rigid3(), kSure, 2);
  filter.Predict(0.1);
  const MotionFilter::Matrix6 as_before = filter.covariance();
  filter.Correct(filter.cam_from_world(), as_before);
  EXPECT_TRUE(filter.covariance().isApprox(as_before));
  MotionFilter other(Rigid3(), kSure, 2);
  other.Predict(0.1);
  other.Predict(0.2);
  filter.Predict(0.2);
  EXPECT_TRUE(filter.covariance().isApprox(other.covariance(), 1e-6));
}

}  // namespace
}  // namespace oaslam
