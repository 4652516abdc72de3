#include "oaslam/service/stream_lens.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

Camera OfFocal(double focal) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = focal;
  return camera;
}

class StreamLensTest : public testing::Test {
 protected:
  void Look(const std::optional<Camera>& camera) { lens_.Add(time_s_ += 2, camera); }
  bool IsOpen() const { return lens_.IsOpen(time_s_ + 2); }

  StreamLens lens_;
  double time_s_ = 100;
};

TEST_F(StreamLensTest, TheMedianOfWhatImagesTell) {
  EXPECT_FALSE(lens_.camera());
  Look(std::nullopt);
  EXPECT_FALSE(lens_.camera());
  Look(OfFocal(580));  // a view that misses it
  EXPECT_EQ(lens_.camera()->fx, 580);
  for (const double focal : {523, 527, 525, 524, 526}) Look(OfFocal(focal));
  EXPECT_NEAR(lens_.camera()->fx, 525, 2);
  EXPECT_TRUE(IsOpen());
  for (const double focal : {480, 525, 520, 560, 525, 522, 526, 528, 519}) Look(OfFocal(focal));
  EXPECT_FALSE(IsOpen());
  EXPECT_NEAR(lens_.camera()->fx, 525, 2);
}

TEST_F(StreamLensTest, ALittleIsNoOtherCamera) {
  for (const double focal : {525.0, 524.9, 524.8, 525.1}) Look(OfFocal(focal));
  EXPECT_EQ(lens_.camera()->fx, 525);
}

TEST_F(StreamLensTest, AnImageThatIsLikeTheLastTellsNothingNew) {
  Look(OfFocal(525));
  EXPECT_FALSE(lens_.IsOpen(time_s_ + 0.5));
  EXPECT_TRUE(lens_.IsOpen(time_s_ + 2));
}

TEST_F(StreamLensTest, ImagesAreLookedAtUntilOneTellsAndSomeAfterThat) {
  for (int i = 0; i < 100; ++i) Look(std::nullopt);
  EXPECT_TRUE(lens_.IsOpen(time_s_));
  Look(OfFocal(525));
  int looks = 0;
  for (; IsOpen() && looks < 100; ++looks) Look(std::nullopt);
  EXPECT_EQ(looks, 30);
}

}  // namespace
}  // namespace oaslam
