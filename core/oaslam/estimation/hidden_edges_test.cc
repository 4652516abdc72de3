#include "oaslam/estimation/hidden_edges.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

const Box kBox{100, 100, 200, 180};

unsigned char HiddenBy(const Box& nearer) { return HiddenEdges(kBox, std::span(&nearer, 1), 1); }

TEST(HiddenEdges, NothingInFrontHidesNothing) {
  EXPECT_EQ(HiddenEdges(kBox, {}, 1), 0);
  EXPECT_EQ(HiddenBy({300, 100, 400, 180}), 0);  // beside
}

TEST(HiddenEdges, AnEdgeBehindSomethingThatReachesBeyondIt) {
  EXPECT_EQ(HiddenBy({180, 90, 260, 190}), kRight);
  EXPECT_EQ(HiddenBy({40, 90, 120, 190}), kLeft);
  EXPECT_EQ(HiddenBy({90, 160, 210, 260}), kBottom);
  EXPECT_EQ(HiddenBy({90, 20, 210, 120}), kTop);
}

TEST(HiddenEdges, ABoxThatEndsWhereTheNearerOneBegins) {
  EXPECT_EQ(HiddenBy({203, 90, 280, 190}), kRight);
}

TEST(HiddenEdges, WhatCoversLessThanMostOfAnEdgeLeavesItVisible) {
  EXPECT_EQ(HiddenBy({180, 140, 260, 260}), 0);
}

TEST(HiddenEdges, WhatStandsWithinTheBoxHidesNoEndOfIt) {
  EXPECT_EQ(HiddenBy({190, 110, 205, 175}), 0);
}

TEST(HiddenEdges, SeveralHideAnEdgeTogether) {
  const Box both[] = {{180, 80, 260, 140}, {185, 140, 250, 200}};
  EXPECT_EQ(HiddenEdges(kBox, both, 1), kRight);
}

TEST(HiddenEdges, TheSamePartTwiceCountsOnce) {
  const Box twice[] = {{180, 140, 260, 260}, {185, 140, 250, 250}};
  EXPECT_EQ(HiddenEdges(kBox, twice, 1), 0);
}

}  // namespace
}  // namespace oaslam
