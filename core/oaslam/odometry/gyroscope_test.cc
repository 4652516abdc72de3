#include "oaslam/odometry/gyroscope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Eigen::Vector3d kBias = Eigen::Vector3d(2, -1, 1.5) * kDegree;
constexpr double kRate = 200;   // samples a second
constexpr double kFrame = 0.1;  // s

// A hand that turns a camera about all axes, by up to 80 degrees a second.
Eigen::Quaterniond StartFromCam(double time_s) {
  return RotationOf({0, 0.7 * std::sin(1.9 * time_s), 0}) *
         RotationOf({0.2 * std::sin(2.7 * time_s + 1), 0, 0.15 * std::sin(3.3 * time_s)});
}

Eigen::Quaterniond TrueTurn(double first_s, double second_s) {
  return StartFromCam(second_s).conjugate() * StartFromCam(first_s);
}

// A gyroscope with the noise of a phone's, 0.007 deg/s/sqrt(Hz) (data sheet of Bosch's BMI160), and
// images whose poses are right to a twentieth of a degree.
class GyroscopeTest : public testing::Test {
 protected:
  // `axes`: those of the samples, as they are given.
  void See(int images, const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
    for (int i = 0; i < images; ++i) {
      const double before = time_s_;
      time_s_ += kFrame;
      const bool was_refused = gyroscope_.state() == GyroscopeState::kRefused;
      gyroscope_.Add(SamplesUntil(time_s_ + 0.25, axes));
      changes_ += (gyroscope_.state() == GyroscopeState::kRefused) != was_refused;
      gyroscope_.Compare(before, time_s_, Measured(before, time_s_));
    }
  }

  std::vector<AngularVelocity> SamplesUntil(double end_s, const Eigen::Matrix3d& axes) {
    std::vector<AngularVelocity> samples;
    for (; sampled_ / kRate <= end_s; ++sampled_) {
      const double t = sampled_ / kRate, step = 1e-4;
      const Eigen::AngleAxisd turn(
          Eigen::Quaterniond(TrueTurn(t + step, t - step)));  // rates are those of start_from_cam
      const double sigma = 0.007 * kDegree * std::sqrt(kRate);
      const Eigen::Vector3d noise(rng_.Gaussian(sigma), rng_.Gaussian(sigma), rng_.Gaussian(sigma));
      samples.push_back(
          {t + offset_s_, axes * (turn.angle() / (2 * step) * turn.axis() + kBias + noise)});
    }
    return samples;
  }

  Eigen::Quaterniond Measured(double first_s, double second_s) {
    const double sigma = 0.05 * kDegree;
    return RotationOf({rng_.Gaussian(sigma), rng_.Gaussian(sigma), rng_.Gaussian(sigma)}) *
           TrueTurn(first_s, second_s);
  }

  Rng rng_{3};
  Gyroscope gyroscope_;
  double offset_s_ = 0.034;
  double time_s_ = 0.5;
  int sampled_ = 0;
  int changes_ = 0;  // between trust and none
};

TEST_F(GyroscopeTest, BiasAndOffsetAreFound) {
  See(100);
  ASSERT_EQ(gyroscope_.state(), GyroscopeState::kCalibrated);
  const GyroscopeCalibration found = gyroscope_.calibration();
  constexpr double kSigmas = 4;
  EXPECT_LT((found.bias - kBias).cwiseAbs().maxCoeff(), kSigmas * found.sigma_bias);
  EXPECT_LT(found.sigma_bias, 0.1 * kDegree);
  EXPECT_LT(std::abs(found.offset_s - offset_s_), kSigmas * found.sigma_offset_s);
  EXPECT_LT(found.sigma_offset_s, 0.003);
  for (const double begin : {4.03, 6.5, 8.21}) {
    const auto turn = gyroscope_.Between(begin, begin + 0.4);
    if (begin < 5.5) {
      EXPECT_FALSE(turn);  // its samples are forgotten
      continue;
    }
    ASSERT_TRUE(turn);
    const Eigen::Quaterniond truth = TrueTurn(begin, begin + 0.4);
    const double off = truth.angularDistance(Eigen::Quaterniond(turn->second_from_first));
    EXPECT_LT(off, kSigmas * std::sqrt(turn->variance));
    EXPECT_LT(off, 0.2 * kDegree);
  }
}

TEST_F(GyroscopeTest, BeforeTheImagesTellAnythingItIsAsUncertainAsAPhones) {
  gyroscope_.Add(SamplesUntil(2, Eigen::Matrix3d::Identity()));
  const auto turn = gyroscope_.Between(1, 1.1);
  ASSERT_TRUE(turn);
  const double off = TrueTurn(1, 1.1).angularDistance(Eigen::Quaterniond(turn->second_from_first));
  EXPECT_GT(off, 0.1 * kDegree);  // the bias and the offset are in it
  EXPECT_LT(off, 3 * std::sqrt(turn->variance));
  EXPECT_EQ(gyroscope_.state(), GyroscopeState::kUnknown);
}

TEST_F(GyroscopeTest, WhileTheCameraStandsStillItsOffsetIsNotKnown) {
  for (int i = 0; i < 100; ++i) {
    gyroscope_.Add(std::vector<AngularVelocity>{{i * 0.05, kBias}});
    gyroscope_.Compare(i * 0.05, (i + 1) * 0.05, Eigen::Quaterniond::Identity());
  }
  EXPECT_LT(gyroscope_.calibration().sigma_bias, 0.2 * kDegree);
  EXPECT_EQ(gyroscope_.state(), GyroscopeState::kUnknown);
}

TEST_F(GyroscopeTest, WhereSamplesAreMissingItTellsNothing) {
  EXPECT_FALSE(gyroscope_.Between(0, 0.1));
  std::vector<AngularVelocity> samples = SamplesUntil(2, Eigen::Matrix3d::Identity());
  std::erase_if(samples,
                [](const AngularVelocity& s) { return s.timestamp > 1.0 && s.timestamp < 1.3; });
  gyroscope_.Add(samples);
  EXPECT_TRUE(gyroscope_.Between(0.8, 0.9));
  EXPECT_FALSE(gyroscope_.Between(0.9, 1.1));
  EXPECT_FALSE(gyroscope_.Between(0.9, 1.5));
  EXPECT_TRUE(gyroscope_.Between(1.4, 1.5));
  EXPECT_FALSE(gyroscope_.Between(1.9, 2.2));
  EXPECT_FALSE(gyroscope_.Between(-0.1, 0.2));
}

TEST_F(GyroscopeTest, OldSamplesAreIgnored) {
  const std::vector<AngularVelocity> samples = SamplesUntil(2, Eigen::Matrix3d::Identity());
  gyroscope_.Add(samples);
  const auto before = gyroscope_.Between(0.5, 1.5);
  gyroscope_.Add(samples);
  const auto after = gyroscope_.Between(0.5, 1.5);
  ASSERT_TRUE(before && after);
  EXPECT_EQ(before->second_from_first.coeffs(), after->second_from_first.coeffs());
}

TEST_F(GyroscopeTest, WrongAxesAreNotBelieved) {
  const Eigen::Matrix3d forward_is_up =
      (Eigen::Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
  See(60, forward_is_up);
  EXPECT_EQ(gyroscope_.state(), GyroscopeState::kRefused);
  EXPECT_FALSE(gyroscope_.Between(time_s_ - 0.2, time_s_ - 0.1));
}

TEST_F(GyroscopeTest, TheTurnsTellTheTrueAxes) {
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(1.3, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  Eigen::Matrix3d swapped;
  swapped << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  for (const Eigen::Matrix3d& axes : {turned, swapped}) {
    gyroscope_ = Gyroscope();
    See(100, axes);
    const auto better = gyroscope_.BetterAxes();
    ASSERT_TRUE(better);
    EXPECT_LT((*better * axes - Eigen::Matrix3d::Identity()).norm(), 0.05);
  }
}

TEST_F(GyroscopeTest, RightAxesAreNotReplaced) {
  See(100);
  EXPECT_FALSE(gyroscope_.BetterAxes());
}

// Axes off by so much fit in some images and not in others.
TEST_F(GyroscopeTest, TrustDoesNotChangeFromImageToImage) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 1, 0).normalized();
  See(1200, Eigen::AngleAxisd(0.4, axis).toRotationMatrix());
  EXPECT_EQ(gyroscope_.state(), GyroscopeState::kRefused);
  EXPECT_EQ(changes_, 1);
  See(400);
  EXPECT_EQ(gyroscope_.state(), GyroscopeState::kCalibrated);
  EXPECT_EQ(changes_, 2);
}

TEST_F(GyroscopeTest, AnOffsetBeyondTheSearchedOnesIsNotBelieved) {
  offset_s_ = 0.3;
  See(200);
  EXPECT_EQ(gyroscope_.state(), GyroscopeState::kRefused);
  EXPECT_LT(std::abs(gyroscope_.calibration().offset_s), Gyroscope::kMostOffset - 0.005);
  EXPECT_FALSE(gyroscope_.Between(time_s_ - 0.2, time_s_ - 0.1));
}

TEST_F(GyroscopeTest, AWrongPoseChangesLittle) {
  See(100);
  const GyroscopeCalibration before = gyroscope_.calibration();
  gyroscope_.Compare(
      time_s_, time_s_ + kFrame,
      RotationOf(Eigen::Vector3d(0, 10, 0) * kDegree) * TrueTurn(time_s_, time_s_ + kFrame));
  time_s_ += kFrame;
  See(5);
  const GyroscopeCalibration after = gyroscope_.calibration();
  EXPECT_LT((after.bias - before.bias).norm(), 0.05 * kDegree);
  EXPECT_LT(std::abs(after.offset_s - before.offset_s), 0.001);
}

}  // namespace
}  // namespace oaslam
