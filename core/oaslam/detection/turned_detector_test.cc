#include "oaslam/detection/turned_detector.h"

#include <numbers>
#include <opencv2/imgproc.hpp>

#include "matchers.h"
#include "oaslam/images/image_files.h"

namespace oaslam {
namespace {

// A detector that knows an arrow: a bright shaft with a head at its upper end. What it is sure of
// stands upright; otherwise it doubts.
std::vector<Detection> DetectArrow(const cv::Mat& image) {
  std::vector<cv::Point> bright;
  cv::findNonZero(image, bright);
  if (bright.empty()) return {};
  const cv::Rect box = cv::boundingRect(bright);
  const cv::Mat arrow = image(box);
  const bool is_upright =
      arrow.rows > arrow.cols &&
      cv::countNonZero(arrow.row(1)) > cv::countNonZero(arrow.row(arrow.rows - 2));
  return {{41,
           is_upright ? 0.9 : 0.3,
           {double(box.x), double(box.y), double(box.br().x), double(box.br().y)},
           std::array<double, 5>{box.x + 0.5 * box.width, box.y + 0.5 * box.height, 8, 4, 0.2}}};
}

// An upright arrow in an image of 100 x 60, turned so that `turn` brings it upright again.
cv::Mat ArrowFor(int turn) {
  cv::Mat image(60, 100, CV_8UC1, cv::Scalar(0));
  image(cv::Rect(20, 10, 12, 6)).setTo(255);
  image(cv::Rect(24, 16, 4, 30)).setTo(255);
  return Turned(image, (4 - turn) % 4);
}

TEST(TurnedDetector, GravityTellsTheTurn) {
  EXPECT_EQ(UprightTurn({0, 9.8, 1}), 0);
  EXPECT_EQ(UprightTurn({9.8, 1, 0}), 1);
  EXPECT_EQ(UprightTurn({0.3, -1, 0}), 2);
  EXPECT_EQ(UprightTurn({-1, 0, 0.5}), 3);
  EXPECT_EQ(UprightTurn({0.1, 0.2, 1}), std::nullopt);
}

TEST(TurnedDetector, BoxesAndEllipsesComeBackInPixelsOfTheImage) {
  const cv::Mat image = ArrowFor(1);
  const Box box = DetectArrow(image)[0].box;
  for (int turn = 0; turn < 4; ++turn) {
    std::vector<Detection> found = DetectArrow(Turned(image, turn));
    TurnBack(turn, image.size(), found);
    EXPECT_EQ(found[0].box, box) << turn;
    EXPECT_DOUBLE_EQ((*found[0].ellipse)[0], box.Center().x());
    EXPECT_DOUBLE_EQ((*found[0].ellipse)[1], box.Center().y());
    EXPECT_NEAR(std::abs(std::sin((*found[0].ellipse)[4] - 0.2 + turn * std::numbers::pi / 2)), 0,
                1e-12);
  }
}

class EachTurn : public ::testing::TestWithParam<int> {};

TEST_P(EachTurn, IsFoundByTheBoxes) {
  const cv::Mat image = ArrowFor(GetParam());
  TurnedDetector detector(DetectArrow);
  for (int i = 0; i < 4; ++i) {
    const std::vector<Detection> found = detector(image);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].score, 0.9);
    EXPECT_EQ(found[0].box, DetectArrow(image)[0].box);
  }
  EXPECT_EQ(detector.turn(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Turns, EachTurn, ::testing::Values(0, 1, 2, 3));

TEST(TurnedDetector, ImagesAsTheyAreArePreferred) {
  int calls = 0;
  TurnedDetector alike([&](const cv::Mat&) -> std::vector<Detection> {
    // Slightly better in the second turn.
    return {{0, calls++ % 4 == 1 ? 0.62 : 0.6, {0, 0, 5, 5}}};
  });
  for (int i = 0; i < 5; ++i) alike(ArrowFor(0));
  EXPECT_EQ(alike.turn(), 0);
  TurnedDetector blind([](const cv::Mat&) { return std::vector<Detection>(); });
  for (int i = 0; i < 11; ++i) EXPECT_THAT(blind(ArrowFor(0)), IsEmpty());
  EXPECT_EQ(blind.turn(), std::nullopt);
  blind(ArrowFor(0));
  EXPECT_EQ(blind.turn(), 0);
}

TEST(TurnedDetector, AKnownTurnIsTaken) {
  TurnedDetector detector(DetectArrow, 3);
  EXPECT_EQ(detector(ArrowFor(3))[0].score, 0.9);
  EXPECT_EQ(detector(ArrowFor(2), 2)[0].score, 0.9);
  EXPECT_EQ(detector(ArrowFor(2))[0].score, 0.3);
}

}  // namespace
}  // namespace oaslam
