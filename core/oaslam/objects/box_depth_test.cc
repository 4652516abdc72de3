#include "oaslam/objects/box_depth.h"

#include <gtest/gtest.h>

#include <vector>

#include "cameras.h"

namespace oaslam {
namespace {

// A wall at 3 m with a thing at 1 m in the middle, of which a stripe in front of it hides a part.
DepthMap Scene(double thing_share) {
  constexpr int kWidth = 160, kHeight = 120;
  std::vector<float> z;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool on_thing = std::abs(x - 80) < thing_share * 30 && std::abs(y - 60) < 30;
      z.push_back(std::abs(x - 60) < 3 ? 0.5F
                  : on_thing           ? 1 + 0.001F * static_cast<float>(y - 60)
                                       : 3);
    }
  return {kWidth, kHeight, z, 640, 480, 0.002, 0.002};
}

const Box kBox{200, 120, 440, 360};

TEST(BoxDepth, TheThingIsToldFromWhatIsBehindAndBeforeIt) {
  EXPECT_NEAR(*SurfaceIn(kBox, synthetic::kCamera, Scene(1)), 1, .01);
  EXPECT_NEAR(*SurfaceIn(kBox, synthetic::kCamera, Scene(.5)), 1, .01);
  EXPECT_NEAR(*SurfaceIn(kBox, synthetic::kCamera, Scene(.05)), 3, .01);  // nothing of it is seen
}

TEST(BoxDepth, NothingIsKnownWhereLittleWasMeasured) {
  const DepthMap empty(160, 120, std::vector<float>(160 * 120), 640, 480, 0.002, 0.002);
  EXPECT_FALSE(SurfaceIn(kBox, synthetic::kCamera, empty));
  EXPECT_FALSE(SurfaceIn({-900, -900, -700, -700}, synthetic::kCamera, Scene(1)));
}

}  // namespace
}  // namespace oaslam
