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
    const std::vector<Detection> found = detector(image, i / 30.0);
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
  for (int i = 0; i < 5; ++i) alike(ArrowFor(0), i / 30.0);
  EXPECT_EQ(alike.turn(), 0);
  TurnedDetector blind([](const cv::Mat&) { return std::vector<Detection>(); });
  for (int i = 0; i < 11; ++i) EXPECT_THAT(blind(ArrowFor(0), i / 30.0), IsEmpty());
  EXPECT_EQ(blind.turn(), std::nullopt);
  blind(ArrowFor(0), 0.4);
  EXPECT_EQ(blind.turn(), 0);
}

TEST(TurnedDetector, AKnownTurnIsTaken) {
  TurnedDetector detector(DetectArrow, 3);
  EXPECT_EQ(detector(ArrowFor(3), 0)[0].score, 0.9);
  EXPECT_EQ(detector(ArrowFor(2), 0.1, 2)[0].score, 0.9);
  EXPECT_EQ(detector(ArrowFor(2), 0.2)[0].score, 0.3);
}

// A film at 30 Hz of views that differ, and a detector with these scores in the four turns of each.
class Film {
 public:
  using Scores = std::array<double, 4>;

  // Goes on for some seconds with a view, or with new views every half second.
  void Show(double seconds, const Scores& scores, bool is_one_view = false) {
    scores_ = scores;
    const double end = time_s_ + seconds;
    for (int i = 0; time_s_ < end; ++i, time_s_ += 1 / 30.0) {
      if (view_.empty() || i == 0 || (!is_one_view && i % 15 == 0)) {
        view_ = cv::Mat(48, 64, CV_8UC1);
        cv::randu(view_, 0, 200);
        view_.at<uchar>(0, 0) = 255;
      }
      found_ = detector_(view_, time_s_);
      ++images_;
    }
  }
  int turn() const { return detector_.turn().value_or(-1); }
  // The score of the last image.
  double score() const { return found_.empty() ? 0 : found_[0].score; }
  // What it cost to look at images in all turns.
  int extra_calls() const { return calls_ - images_; }
  void SetHeldTurn(int turn) { detector_.SetHeldTurn(turn); }

 private:
  std::vector<Detection> Detect(const cv::Mat& image) {
    ++calls_;
    const int right = image.cols - 1, bottom = image.rows - 1;
    const std::array corners{cv::Point(0, 0), cv::Point(right, 0), cv::Point(right, bottom),
                             cv::Point(0, bottom)};
    for (size_t turn = 0; turn < 4; ++turn)
      if (image.at<uchar>(corners[turn]) == 255 && scores_[turn] > 0)
        return {{0, scores_[turn], {0, 0, 9, 9}}};
    return {};
  }

  Scores scores_{};
  cv::Mat view_;
  double time_s_ = 0;
  int calls_ = 0, images_ = 0;
  std::vector<Detection> found_;
  TurnedDetector detector_{[this](const cv::Mat& image) { return Detect(image); }};
};

const Film::Scores kNone{}, kUpright{0.9, 0.4, 0.5, 0.4}, kUpsideDown{0.3, 0.2, 0.9, 0.2},
    kSideways{0.4, 0.9, 0.4, 0.5};

TEST(TurnedDetector, OneViewDoesNotTurnAFilm) {
  Film film;
  film.Show(1, kUpsideDown, true);
  EXPECT_EQ(film.turn(), 2);
  film.Show(4, kUpright);
  EXPECT_EQ(film.turn(), 0);
  EXPECT_EQ(film.score(), 0.9);
  film.Show(20, kUpsideDown, true);
  EXPECT_EQ(film.turn(), 0);
}

TEST(TurnedDetector, ATurnedFilmStaysTurned) {
  Film film;
  film.Show(0.2, kSideways);
  EXPECT_EQ(film.turn(), 1);
  film.Show(1, kUpright, true);
  film.Show(60, kSideways);
  EXPECT_EQ(film.turn(), 1);
  EXPECT_EQ(film.score(), 0.9);
  Film still;  // a camera that does not move
  still.Show(40, kSideways, true);
  EXPECT_EQ(still.turn(), 1);
}

TEST(TurnedDetector, ATurnIsFoundLaterToo) {
  Film film;
  film.Show(1, kNone);
  EXPECT_EQ(film.turn(), 0);
  film.Show(20, kSideways);
  EXPECT_EQ(film.turn(), 1);
  Film unclear;
  unclear.Show(1, {0.5, 0.52, 0.5, 0.5}, true);
  EXPECT_EQ(unclear.turn(), 0);
  unclear.Show(30, kSideways);
  EXPECT_EQ(unclear.turn(), 1);
}

TEST(TurnedDetector, LooksAreFew) {
  Film upright;
  upright.Show(60, kUpright);
  EXPECT_EQ(upright.extra_calls(), 4 * 3);
  Film blind;
  blind.Show(60, kNone);
  EXPECT_LE(blind.extra_calls(), (12 + 8) * 3);
  Film sideways;
  sideways.Show(60, kSideways);
  EXPECT_LE(sideways.extra_calls(), (4 + 12) * 3);
}

TEST(TurnedDetector, HowTheCameraWasHeldCounts) {
  Film flat;  // a desk from above, whose boxes hardly tell the turn
  flat.Show(3, {0.6, 0.5, 0.85, 0.5});
  EXPECT_EQ(flat.turn(), 2);
  flat.SetHeldTurn(0);
  EXPECT_EQ(flat.turn(), 0);
  Film sideways;
  sideways.Show(3, {0.5, 0.6, 0.4, 0.63});
  sideways.SetHeldTurn(1);
  EXPECT_EQ(sideways.turn(), 1);
  Film clear;  // boxes that tell the turn well are not outvoted
  clear.Show(3, kUpright);
  clear.SetHeldTurn(1);
  EXPECT_EQ(clear.turn(), 0);
  Film turned;
  turned.Show(6, {0.2, 0.9, 0.2, 0.2});
  turned.SetHeldTurn(0);
  EXPECT_EQ(turned.turn(), 1);
}

}  // namespace
}  // namespace oaslam
