#include "oaslam/odometry/odometry.h"

#include <gtest/gtest.h>

#include "grey_scene.h"

namespace oaslam {
namespace {

constexpr int kWallWidth = 320, kWallHeight = 240;

// A camera that looks at a wall of noise in squares.
class OdometryTest : public testing::Test {
 protected:
  OdometryEstimate See(const GreyBuffer& image) {
    return odometry_.Process(image.view(), ++images_ / 30.0);
  }
  OdometryEstimate SeeFrom(int place) {
    return See(synthetic::Drawn(kWallWidth, kWallHeight,
                                [&](int x, int y) { return wall_.At(place + x, y); }));
  }

  const synthetic::NoiseSquares wall_{200, 4, 1};
  Odometry odometry_{
      {.width = kWallWidth, .height = kWallHeight, .fx = 300, .fy = 300, .cx = 160, .cy = 120},
      {},
      0};
  int images_ = 0;
};

TEST_F(OdometryTest, AWallThatMovesIsFollowed) {
  OdometryEstimate estimate;
  for (int i = 0; i < 10; ++i) estimate = SeeFrom(2 * i);
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.run, 0);
  EXPECT_EQ(estimate.image, 9);
  EXPECT_GT(estimate.tracked, 40);
}

TEST_F(OdometryTest, ASuddenTurnIsFollowed) {
  for (int i = 0; i < 5; ++i) SeeFrom(2 * i);
  const OdometryEstimate estimate = SeeFrom(100);  // a quarter of the image
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.run, 0);
  EXPECT_GT(estimate.tracked, 40);
}

TEST_F(OdometryTest, AnImageWithoutTextureEndsTheRun) {
  for (int i = 0; i < 5; ++i) SeeFrom(2 * i);
  const auto even = [](int, int) { return 90; };
  EXPECT_EQ(See(synthetic::Drawn(kWallWidth, kWallHeight, even)).state, OdometryState::kBlind);
  OdometryEstimate estimate;
  for (int i = 0; i < 5; ++i) estimate = SeeFrom(10 + 2 * i);
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_GT(estimate.run, 0);
  EXPECT_GT(estimate.tracked, 40);
}

// The wall is 2 m away.
class OdometryDepthTest : public OdometryTest {
 protected:
  // The measured depths as a function of x, 0 to 1.
  template <typename Depth>
  OdometryEstimate SeeWith(int place, Depth&& depth) {
    constexpr int kWidth = 80, kHeight = 60;
    std::vector<float> z;
    for (int i = 0; i < kWidth * kHeight; ++i)
      z.push_back(static_cast<float>(depth((i % kWidth + 0.5) / kWidth)));
    const GreyBuffer image = synthetic::Drawn(kWallWidth, kWallHeight,
                                              [&](int x, int y) { return wall_.At(place + x, y); });
    return odometry_.Process(
        image.view(), ++images_ / 30.0,
        {{},
         {},
         std::make_shared<const DepthMap>(kWidth, kHeight, std::move(z), kWallWidth, kWallHeight,
                                          .002, .002)});
  }
  static double Right(double) { return 2; }
  static constexpr double kStep = 2 * 2.0 / 300;  // of the camera, m, where the image moves by 2 px
};

TEST_F(OdometryDepthTest, TheMotionIsInMetresFromTheFirstImageOn) {
  OdometryEstimate estimate = SeeWith(0, Right);
  EXPECT_EQ(estimate.state, OdometryState::kTracking);
  EXPECT_EQ(estimate.metres_per_unit, 1);
  EXPECT_GT(odometry_.Depths().size(), 40U);
  for (int i = 1; i < 20; ++i) {
    estimate = SeeWith(2 * i, Right);
    ASSERT_EQ(estimate.state, OdometryState::kTracking) << i;
    EXPECT_NEAR(estimate.cam_from_odom.OriginInSource().x(), i * kStep, .02 * i * kStep + .002);
  }
  EXPECT_EQ(estimate.run, 0);
  EXPECT_EQ(estimate.metres_per_unit, 1);
  EXPECT_GT(estimate.metre_sigma, 0);
}

TEST_F(OdometryDepthTest, ARunThatBeginsAnewIsInMetresAtOnce) {
  for (int i = 0; i < 5; ++i) SeeWith(2 * i, Right);
  EXPECT_EQ(See(synthetic::Drawn(kWallWidth, kWallHeight, [](int, int) { return 90; })).state,
            OdometryState::kBlind);
  OdometryEstimate estimate;
  for (int i = 0; i < 5; ++i) estimate = SeeWith(10 + 2 * i, Right);
  EXPECT_EQ(estimate.state, OdometryState::kTracking);
  EXPECT_GT(estimate.run, 0);
  EXPECT_EQ(estimate.metres_per_unit, 1);
}

TEST_F(OdometryDepthTest, WithoutDepthsTheUnitIsNotKnown) {
  OdometryEstimate estimate;
  for (int i = 0; i < 5; ++i) estimate = SeeWith(2 * i, [](double) { return 0; });
  EXPECT_EQ(estimate.state, OdometryState::kPreliminary);
  EXPECT_EQ(estimate.metres_per_unit, 0);
}

TEST_F(OdometryDepthTest, ASurfaceThatIsElsewhereDoesNotBendTheMotion) {
  // A tenth of the image has the depth of something nearer.
  const auto some_wrong = [](double x) { return x > .2 && x < .3 ? 1.2 : 2.0; };
  OdometryEstimate estimate;
  for (int i = 0; i < 30; ++i) estimate = SeeWith(2 * i, some_wrong);
  EXPECT_EQ(estimate.state, OdometryState::kTracking);
  EXPECT_NEAR(estimate.cam_from_odom.OriginInSource().x(), 29 * kStep, .05 * 29 * kStep);
}

TEST_F(OdometryDepthTest, DepthsThatContradictTheImagesAreNotUsed) {
  const auto wrong = [](double x) { return 1.2 + 1.6 * std::abs(x - .5) * 2; };
  bool is_refused = false;
  for (int i = 0; i < 250 && !is_refused; ++i) {
    const OdometryEstimate estimate = SeeWith(2 * i, wrong);
    is_refused = odometry_.RefusesDepth();
    EXPECT_EQ(estimate.metres_per_unit, is_refused ? 0 : 1);
  }
  EXPECT_TRUE(is_refused);
}

TEST(DepthTrustTest, DepthsThatFitBetterReadAnotherWayAreNamed) {
  const auto problem_of = [](size_t best, double spread, double share_wrong) {
    DepthTrust trust;
    for (int image = 0; image < 5; ++image) {
      EXPECT_TRUE(trust.IsDue(image));
      std::array<DepthTrust::Views, DepthTrust::kReadings.size()> views;
      for (size_t reading = 0; reading < views.size(); ++reading)
        for (int i = 0; i < 100; ++i) {
          const double off = reading == best ? .5 * spread : spread,
                       as_given = reading == DepthTrust::kAsGiven ? off : spread;
          const bool is_wrong = i < 100 * share_wrong;
          const double wrong = .3 + (is_wrong ? 1 : 0), sign = i % 2 ? 1 : -1;
          views[reading].push_back({wrong + sign * off, wrong + sign * as_given, .01});
        }
      trust.Add(image, views);
    }
    return trust.Problem();
  };
  EXPECT_EQ(problem_of(5, .004, .05), "");
  EXPECT_NE(problem_of(5, .03, .05).find("magnified by 0.91"), std::string::npos);
  EXPECT_NE(problem_of(8, .03, .05).find("with -0.2 m added"), std::string::npos);
  EXPECT_NE(problem_of(18, .03, .05)
                .find("of 0.10 s before better: the clock of the depth camera is late"),
            std::string::npos);
  EXPECT_NE(problem_of(DepthTrust::kAsGiven, .01, .45).find("45 % of them contradict"),
            std::string::npos);
}

}  // namespace
}  // namespace oaslam
