#include "oaslam/odometry/still_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "grey_scene.h"
#include "matchers.h"

namespace oaslam {
namespace {

constexpr int kRoomWidth = 320, kRoomHeight = 240;

using Pixel = std::function<uint8_t(double time_s, int x, int y)>;

// What is known after so many seconds at 10 Hz.
StillParts PartsAfter(double seconds, const Pixel& pixel) {
  StillParts parts;
  for (int i = 0; i < 10 * seconds; ++i) {
    const GreyBuffer image = synthetic::Drawn(kRoomWidth, kRoomHeight,
                                              [&](int x, int y) { return pixel(i / 10.0, x, y); });
    parts.Add(image.view(), i / 10.0);
  }
  return parts;
}

ImageMask MaskAfter(double seconds, const Pixel& pixel) {
  return PartsAfter(seconds, pixel).mask();
}

// Where the camera looks: to and fro, as one in a hand.
int LookX(double t) { return 2000 + static_cast<int>(std::lround(40 * std::sin(t))); }
int LookY(double t) { return 2000 + static_cast<int>(std::lround(30 * std::sin(1.5 * t))); }

const synthetic::NoiseSquares kRoom(160, 6, 1), kBonnet(160, 6, 2);

uint8_t Turning(double t, int x, int y) { return kRoom.At(LookX(t) + x, LookY(t) + y); }

TEST(StillParts, ABonnetIsFound) {
  const ImageMask mask = MaskAfter(
      8, [](double t, int x, int y) { return y >= 180 ? kBonnet.At(x, y) : Turning(t, x, y); });
  EXPECT_NEAR(mask.HiddenShare(), 0.27, 0.06);
  for (double x = 0.05; x < 1; x += 0.1) {
    EXPECT_TRUE(mask.Hides(x, 0.85)) << x;
    EXPECT_FALSE(mask.Hides(x, 0.6)) << x;
  }
  EXPECT_THAT(Describe(mask), HasSubstr("at the bottom"));
}

TEST(StillParts, AnOverlayIsFound) {
  const ImageMask mask = MaskAfter(8, [](double t, int x, int y) {
    return x < 100 && y < 60 ? kBonnet.At(x, y) : Turning(t, x, y);
  });
  EXPECT_TRUE(mask.Hides(0.15, 0.12));
  EXPECT_FALSE(mask.Hides(0.5, 0.5));
  EXPECT_NEAR(mask.HiddenShare(), 0.1, 0.05);
}

TEST(StillParts, ACameraThatOnlyTurnsHasNone) {
  EXPECT_EQ(MaskAfter(12, Turning).HiddenShare(), 0);
}

TEST(StillParts, OnlyACameraThatMovedLongEnoughIsDoneWith) {
  EXPECT_FALSE(PartsAfter(4, Turning).IsSettled());
  EXPECT_TRUE(PartsAfter(12, Turning).IsSettled());
  EXPECT_FALSE(PartsAfter(12, [](double, int x, int y) { return kRoom.At(x, y); }).IsSettled());
  EXPECT_FALSE(PartsAfter(12, [](double t, int x, int y) {
                 return y >= 180 ? kBonnet.At(x, y) : Turning(t, x, y);
               }).IsSettled());
}

TEST(StillParts, ACameraThatStandsHasNone) {
  EXPECT_EQ(MaskAfter(12, [](double, int x, int y) { return kRoom.At(x, y); }).HiddenShare(), 0);
}

// Somebody walks to and fro before a camera that stands.
TEST(StillParts, WhatMovesBeforeACameraThatStandsHidesNothing) {
  EXPECT_EQ(MaskAfter(12,
                      [](double t, int x, int y) {
                        const int left = 100 + LookX(t) - 2000;
                        return x > left && x < left + 120 ? kBonnet.At(x - left, y + LookY(t))
                                                          : kRoom.At(x, y);
                      })
                .HiddenShare(),
            0);
}

// Hills beyond what passes a train's window.
TEST(StillParts, WhatIsFarIsNotTakenForAPartWhereTheCameraMovesOneWay) {
  EXPECT_EQ(MaskAfter(12,
                      [](double t, int x, int y) {
                        return y < 80 ? kBonnet.At(x, y)
                                      : kRoom.At(x + static_cast<int>(30 * t), y);
                      })
                .HiddenShare(),
            0);
}

TEST(StillParts, APartThatGoesAwayIsUsedAgain) {
  const auto with_part_until = [](double end) {
    return [end](double t, int x, int y) {
      return t < end && y >= 180 ? kBonnet.At(x, y) : Turning(t, x, y);
    };
  };
  EXPECT_GT(MaskAfter(8, with_part_until(8)).HiddenShare(), 0.2);
  EXPECT_EQ(MaskAfter(30, with_part_until(8)).HiddenShare(), 0);
}

}  // namespace
}  // namespace oaslam
