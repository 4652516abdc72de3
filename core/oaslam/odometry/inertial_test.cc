#include "oaslam/odometry/inertial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Eigen::Vector3d kImuBias(0.1, -0.15, 0.05), kImuLever(0.03, -0.02, 0.01),
    kGravityThere(0.2 * kGravity, 0, -std::sqrt(1 - 0.04) * kGravity);
constexpr double kUnitLength = 0.4;    // metres
constexpr double kImuRate = 200;       // samples a second
constexpr double kImageSpacing = 0.1;  // s

// A hand that waves and turns an IMU beside a camera.
Rigid3 WorldFromCam(double t) {
  const Eigen::Quaterniond rotation = RotationOf({0, 0.5 * std::sin(1.9 * t), 0}) *
                                      RotationOf({0.3 * std::sin(1.3 * t), 0, 0.1 * std::sin(t)});
  return Rigid3(Rigid3::Rotation(rotation),
                Eigen::Vector3d(0.2 * std::sin(5 * t), 0.15 * std::cos(4 * t), 0.5 * t));
}

Eigen::Vector3d PlaceOfImu(double t) { return WorldFromCam(t) * kImuLever; }

std::vector<ImuSample> Samples(double end_s, double sign = 1) {
  constexpr double kStep = 1e-4;
  Rng rng(2);
  std::vector<ImuSample> samples;
  for (int i = 0; i / kImuRate <= end_s; ++i) {
    const double t = i / kImuRate;
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(WorldFromCam(t - kStep).rotation.conjugate() *
                                                    WorldFromCam(t + kStep).rotation));
    const Eigen::Vector3d acceleration =
        (PlaceOfImu(t + kStep) - 2 * PlaceOfImu(t) + PlaceOfImu(t - kStep)) / (kStep * kStep);
    const Eigen::Vector3d noise(rng.Gaussian(0.02), rng.Gaussian(0.02), rng.Gaussian(0.02));
    samples.push_back(
        {t, turn.angle() / (2 * kStep) * turn.axis(),
         sign * (WorldFromCam(t).rotation.conjugate() * (acceleration - kGravityThere) + kImuBias +
                 noise)});
  }
  return samples;
}

struct InertialTest : testing::Test {
  explicit InertialTest(double sign = 1) { accelerometer.Add(Samples(5, sign)); }

  Push Between(double first_s, double second_s) const {
    return accelerometer.Between(first_s, second_s, {}).value();
  }
  // As the odometry sees them, in its unit.
  static std::array<Rigid3, 3> PosesAt(double middle_s) {
    std::array<Rigid3, 3> poses;
    for (int i = 0; i < 3; ++i) {
      Rigid3 pose = WorldFromCam(middle_s + (i - 1) * kImageSpacing);
      pose.translation /= kUnitLength;
      poses[i] = pose.Inverse();
    }
    return poses;
  }
  InertialTriple TripleAt(double middle_s) const {
    return {0, 1, 2, Between(middle_s - kImageSpacing, middle_s),
            Between(middle_s, middle_s + kImageSpacing)};
  }
  static InertialVector Truth() {
    InertialVector truth;
    truth << kUnitLength, kGravityThere, kImuBias;
    return truth;
  }
  std::vector<KnownTriple> Known(double end_s) const {
    std::vector<KnownTriple> triples;
    for (double t = 2 * kImageSpacing; t < end_s; t += kImageSpacing)
      triples.push_back(oaslam::Known(TripleAt(t), PosesAt(t), kImuLever, 1e-3));
    return triples;
  }

  Accelerometer accelerometer;
};

struct UpsideDown : InertialTest {
  UpsideDown() : InertialTest(-1) {}
};

TEST_F(InertialTest, PushesAddUp) {
  const Push first = Between(1, 1.21), second = Between(1.21, 1.4), whole = Between(1, 1.4);
  const Push composed = Composed(
      first,
      (WorldFromCam(1).rotation.conjugate() * WorldFromCam(1.21).rotation).toRotationMatrix(),
      second);
  EXPECT_NEAR(composed.seconds, 0.4, 1e-9);
  EXPECT_LT((composed.velocity - whole.velocity).norm(), 1e-3);
  EXPECT_LT((composed.place - whole.place).norm(), 1e-3);
  EXPECT_LT((composed.velocity_by_bias - whole.velocity_by_bias).norm(), 1e-3);
  EXPECT_LT((composed.place_by_bias - whole.place_by_bias).norm(), 1e-3);
}

TEST_F(InertialTest, AGapTellsNothing) {
  EXPECT_FALSE(accelerometer.Between(-0.2, 0.1, {}));
  EXPECT_FALSE(accelerometer.Between(4.9, 5.3, {}));
  std::vector<ImuSample> samples = Samples(2);
  std::erase_if(samples, [](const ImuSample& s) { return s.timestamp > 1 && s.timestamp < 1.2; });
  Accelerometer other;
  other.Add(samples);
  EXPECT_TRUE(other.Between(0.8, 0.9, {}));
  EXPECT_FALSE(other.Between(0.9, 1.3, {}));
  GyroscopeCalibration late;
  late.offset_s = 0.4;
  EXPECT_TRUE(other.Between(0.9, 1.3, late));
}

TEST_F(InertialTest, ATripleFitsTheTruth) {
  InertialTriple triple = TripleAt(1.3);
  triple.sigma = 0.02 * std::sqrt(kImageSpacing);
  EXPECT_LT(ResidualOf(triple, PosesAt(1.3), kImuLever, Truth()).value.norm(), 4);
  InertialVector other = Truth();
  other[0] *= 1.5;
  EXPECT_GT(ResidualOf(triple, PosesAt(1.3), kImuLever, other).value.norm(), 8);
}

TEST_F(InertialTest, ItsDerivativesAreThoseOfDifferences) {
  constexpr double kStep = 1e-6;
  const InertialTriple triple = TripleAt(1.3);
  const auto poses = PosesAt(1.3);
  const InertialResidual at = ResidualOf(triple, poses, kImuLever, Truth());
  for (int k = 0; k < 7; ++k) {
    InertialVector moved = Truth();
    moved[k] += kStep;
    const Eigen::Vector3d slope =
        (ResidualOf(triple, poses, kImuLever, moved).value - at.value) / kStep;
    EXPECT_LT((slope - at.by_inertial.col(k)).norm(), 1e-4 * (1 + slope.norm())) << k;
  }
  for (int i = 0; i < 3; ++i) {
    // The centre moves by -R^T v under a step v.
    Eigen::Matrix<double, 3, 6> by_pose;
    by_pose << -at.by_center[i] * poses[i].rotation.conjugate().toRotationMatrix(),
        at.by_rotation[i];
    for (int k = 0; k < 6; ++k) {
      auto moved = poses;
      moved[i] = Moved(poses[i], PoseVector(kStep * PoseVector::Unit(k)));
      const Eigen::Vector3d slope =
          (ResidualOf(triple, moved, kImuLever, Truth()).value - at.value) / kStep;
      EXPECT_LT((slope - by_pose.col(k)).norm(), 1e-4 * (1 + slope.norm())) << i << " " << k;
    }
  }
}

TEST_F(InertialTest, UnitGravityAndBiasFollowFromKnownPoses) {
  const auto fit = FitInertial(Known(4.5), 0.01);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->value[0] / kUnitLength, 1, 0.01);
  EXPECT_LT(fit->sigma_unit, 0.02);
  EXPECT_LT(std::abs(std::log(fit->value[0] / kUnitLength)), 4 * fit->sigma_unit);
  EXPECT_LT((fit->value.segment<3>(1) - kGravityThere).norm(), 0.05);
  EXPECT_LT((fit->value.tail<3>() - kImuBias).norm(), 0.05);
  EXPECT_LT(fit->chi2, 1);
}

TEST_F(InertialTest, AShortMotionTellsLess) {
  const auto little = FitInertial(Known(0.9), 0.01), much = FitInertial(Known(4.5), 0.01);
  ASSERT_TRUE(little && much);
  EXPECT_GT(little->sigma_unit, 1.5 * much->sigma_unit);
  EXPECT_FALSE(FitInertial(Known(0.4), 0.01)) << "two triples";
}

// The equations of the triples near their solution are solved by it.
TEST_F(InertialTest, ThePriorIsThatOfTheTriples) {
  const auto triples = Known(4.5);
  const auto fit = FitInertial(triples, 0.01);
  ASSERT_TRUE(fit);
  InertialPrior prior = PriorBy(triples, 0.01, fit->value);
  const InertialVector gravity = GravityDerivative(fit->value);
  prior.information += gravity * gravity.transpose();
  prior.right += gravity * (gravity.dot(fit->value) - GravityError(fit->value));
  const InertialVector solved = prior.information.ldlt().solve(prior.right);
  EXPECT_LT((solved - fit->value).norm(), 2e-3);
}

TEST_F(UpsideDown, AccelerationsOfTheOtherSignShow) {
  const auto fit = FitInertial(Known(4.5), 0.01);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->value[0], 0);
  EXPECT_LT(fit->chi2, 1);
}

TEST_F(InertialTest, AccelerationsOfAnotherTimeDoNotFit) {
  std::vector<KnownTriple> triples;
  for (double t = 2 * kImageSpacing; t < 4; t += kImageSpacing)
    triples.push_back(oaslam::Known(TripleAt(t + 0.3), PosesAt(t), kImuLever, 1e-3));
  const auto fit = FitInertial(triples, 0.01);
  EXPECT_TRUE(!fit || fit->chi2 > 4 || fit->sigma_unit > 0.1);
}

}  // namespace
}  // namespace oaslam
