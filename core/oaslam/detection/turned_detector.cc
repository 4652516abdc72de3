#include "oaslam/detection/turned_detector.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "oaslam/images/image_files.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// What boxes have to gain for the images to be turned: a factor, and squared scores in so many
// views.
constexpr double kRatio = 1.3, kMargin = 0.5, kEnoughViews = 4;
constexpr int kEnough = 4;  // of the first images with a box

int IndexOfMost(const std::array<double, 4>& values) {
  return static_cast<int>(std::ranges::max_element(values) - values.begin());
}

}  // namespace

std::optional<int> UprightTurn(const Eigen::Vector3d& gravity_in_cam) {
  constexpr double kLeast = 0.35;  // of gravity within the image: 20 degrees off the view
  const double x = gravity_in_cam.x(), y = gravity_in_cam.y();
  if (!(std::hypot(x, y) > kLeast * gravity_in_cam.norm())) return std::nullopt;
  if (std::abs(y) >= std::abs(x)) return y > 0 ? 0 : 2;
  return x > 0 ? 1 : 3;
}

void TurnBack(int turn, const cv::Size& size, std::vector<Detection>& detections) {
  const double width = size.width, height = size.height;
  const auto back = [&](double x, double y) -> Eigen::Vector2d {
    if (turn == 1) return {y, height - x};
    if (turn == 2) return {width - x, height - y};
    if (turn == 3) return {width - y, x};
    return {x, y};
  };
  for (Detection& d : detections) {
    const Eigen::Vector2d a = back(d.box.x1, d.box.y1), b = back(d.box.x2, d.box.y2);
    d.box = {std::min(a.x(), b.x()), std::min(a.y(), b.y()), std::max(a.x(), b.x()),
             std::max(a.y(), b.y())};
    if (!d.ellipse) continue;
    auto& [cx, cy, ellipse_width, ellipse_height, theta] = *d.ellipse;
    const Eigen::Vector2d centre = back(cx, cy);
    cx = centre.x();
    cy = centre.y();
    theta -= turn * std::numbers::pi / 2;
    while (theta <= -std::numbers::pi / 2) theta += std::numbers::pi;
  }
}

std::vector<Detection> TurnedDetector::DetectIn(const cv::Mat& image, int turn) const {
  std::vector<Detection> found = detect_(Turned(image, turn));
  TurnBack(turn, image.size(), found);
  return found;
}

std::vector<Detection> TurnedDetector::operator()(const cv::Mat& image, double timestamp,
                                                  std::optional<int> known) {
  if (known || is_settled_) return DetectIn(image, known.value_or(turn_));
  if (!begun_s_) begun_s_ = next_s_ = timestamp;
  const bool is_first = !HasFirst();
  if (!is_first && timestamp < next_s_) return DetectIn(image, turn_);
  std::array<std::vector<Detection>, 4> found;
  Look(image, found);
  if (!is_first) {
    Decide();
  } else if (HasFirst()) {
    DecideFirst();
  } else {
    turn_ = IndexOfMost(first_);
  }
  constexpr double kSoon_s = 0.5, kDoubtful_s = 30;
  const double elapsed_s = timestamp - *begun_s_;
  next_s_ = timestamp +
            (is_doubtful() && elapsed_s < kDoubtful_s ? kSoon_s : std::max(elapsed_s, 2 * kSoon_s));
  return found[turn_];
}

std::optional<int> TurnedDetector::turn() const {
  return is_settled_ || HasFirst() ? std::optional(turn_) : std::nullopt;
}

bool TurnedDetector::is_doubtful() const {
  return HasFirst() && turn_ != 0 && views_ < kEnoughViews;
}

// Whether the first images have been looked at.
bool TurnedDetector::HasFirst() const {
  constexpr int kMost = 12;  // images
  return showed_ >= kEnough || looked_at_ >= kMost;
}

void TurnedDetector::Look(const cv::Mat& image, std::array<std::vector<Detection>, 4>& found) {
  Scores scores{};
  bool shows = false;
  for (int turn = 0; turn < 4; ++turn) {
    found[turn] = DetectIn(image, turn);
    shows = shows || !found[turn].empty();
    for (const Detection& d : found[turn]) scores[turn] += d.score * d.score;
  }
  ++looked_at_;
  showed_ += shows ? 1 : 0;
  for (int turn = 0; turn < 4; ++turn) first_[turn] += scores[turn];
  if (!shows) return;
  const double novelty = NoveltyOf(image);
  views_ += novelty;
  for (int turn = 0; turn < 4; ++turn) sums_[turn] += novelty * scores[turn];
}

// How little an image resembles the most similar one before it, up to 1.
double TurnedDetector::NoveltyOf(const cv::Mat& image) {
  constexpr double kLeast = 0.1;  // noise and small motions make boxes vary
  constexpr size_t kMost = 100;   // images, which bounds the time
  const cv::Size size(16, 12);
  cv::Mat grey = image, small;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::resize(grey, small, size, 0, 0, cv::INTER_AREA);
  double novelty = 1;
  for (const cv::Mat& before : seen_) {
    cv::Mat correlation;
    cv::matchTemplate(small, before, correlation, cv::TM_CCOEFF_NORMED);
    novelty = std::min(novelty, 1.0 - correlation.at<float>(0, 0));
  }
  if (seen_.size() < kMost) seen_.push_back(small);
  return std::clamp(novelty, kLeast, 1.0);
}

void TurnedDetector::DecideFirst() {
  // Detectors find some of what is turned, too, and boxes vary from image to image.
  const int best = IndexOfMost(first_);
  is_settled_ = best == 0 && showed_ >= kEnough;
  turn_ = 0;
  if (first_[best] > kRatio * first_[0] + kMargin) Turn(best);
}

void TurnedDetector::Decide() {
  // The rule of the first images, written so that a turn may be preferred by a factor. Before there
  // are many views, the margin is smaller.
  const double doubt = kMargin / (kRatio - 1) * std::clamp(views_ / kEnoughViews, 0.01, 1.0);
  Scores evidence{};
  for (int turn = 0; turn < 4; ++turn) {
    evidence[turn] = (sums_[turn] + doubt) * (turn == 0 ? kRatio : 1);
    if (!held_turn_) continue;
    // How the camera was held tells sideways from upright, and less surely the side that is up.
    if (turn == *held_turn_) evidence[turn] *= kRatio * kRatio;
    if (turn == (*held_turn_ + 2) % 4) evidence[turn] *= kRatio;
  }
  Turn(IndexOfMost(evidence));
}

void TurnedDetector::Turn(int turn) {
  if (turn == turn_) return;
  turn_ = turn;
  if (turn_ == 0)
    Log(LogLevel::kInfo, "detector: gets the images as they are from now on");
  else
    Log(LogLevel::kInfo,
        "detector: gets the images turned by {} degrees clockwise, which gives better boxes in {} "
        "images (sum of squared scores {:.1f}; as they are {:.1f})",
        90 * turn_, looked_at_, first_[turn_], first_[0]);
}

void TurnedDetector::SetHeldTurn(int turn) {
  if (is_settled_ || held_turn_ == turn || !HasFirst()) return;
  held_turn_ = turn;
  Decide();
}

}  // namespace oaslam
