#include "oaslam/odometry/still_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/odometry/corners.h"
#include "oaslam/odometry/patch_flow.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr int kComparedWidth = 480;  // px of the images that are compared: noise is averaged
constexpr int kComparedLevels = 5;
constexpr double kLeastStep_s = 0.15, kMostStep_s = 2;  // between two images that are compared
constexpr double kEarlier_s = 1.5;  // an earlier one is so old, up to twice as much

// The correlation of the patches of 9 x 9 pixels at two places, from -1 to 1; 0 where there is
// none.
double Correlation(const GreyImage& a, const Eigen::Vector2f& at_a, const GreyImage& b,
                   const Eigen::Vector2f& at_b) {
  constexpr int kHalf = 4;
  const int ax = static_cast<int>(std::lround(at_a.x())),
            ay = static_cast<int>(std::lround(at_a.y())),
            bx = static_cast<int>(std::lround(at_b.x())),
            by = static_cast<int>(std::lround(at_b.y()));
  const auto is_inside = [](const GreyImage& image, int x, int y) {
    return x >= kHalf && y >= kHalf && x < image.width - kHalf && y < image.height - kHalf;
  };
  if (!is_inside(a, ax, ay) || !is_inside(b, bx, by)) return 0;
  double sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  for (int dy = -kHalf; dy <= kHalf; ++dy)
    for (int dx = -kHalf; dx <= kHalf; ++dx) {
      const double u = a.Row(ay + dy)[ax + dx], v = b.Row(by + dy)[bx + dx];
      sum_a += u, sum_b += v, aa += u * u, bb += v * v, ab += u * v;
    }
  constexpr double kCount = (2 * kHalf + 1) * (2 * kHalf + 1);
  const double variance = (aa - sum_a * sum_a / kCount) * (bb - sum_b * sum_b / kCount);
  return variance > 1 ? (ab - sum_a * sum_b / kCount) / std::sqrt(variance) : 0;
}

// Each connected part of `cells` that has at least `least` of them.
void KeepLargeParts(int columns, size_t least, std::vector<char>& cells) {
  std::vector<char> seen(cells.size());
  const int rows = static_cast<int>(cells.size()) / columns;
  for (size_t first = 0; first < cells.size(); ++first) {
    if (!cells[first] || seen[first]) continue;
    std::vector<size_t> part{first};
    seen[first] = 1;
    for (size_t k = 0; k < part.size(); ++k) {
      const int x = static_cast<int>(part[k]) % columns, y = static_cast<int>(part[k]) / columns;
      for (int ny = std::max(0, y - 1); ny < std::min(rows, y + 2); ++ny)
        for (int nx = std::max(0, x - 1); nx < std::min(columns, x + 2); ++nx)
          if (const size_t n = ny * columns + nx; cells[n] && !seen[n]) {
            seen[n] = 1;
            part.push_back(n);
          }
    }
    if (part.size() < least)
      for (const size_t i : part) cells[i] = 0;
  }
}

int NeighboursIn(const std::vector<char>& cells, int columns, size_t i) {
  const int rows = static_cast<int>(cells.size()) / columns, x = static_cast<int>(i) % columns,
            y = static_cast<int>(i) / columns;
  int count = 0;
  for (int ny = std::max(0, y - 1); ny < std::min(rows, y + 2); ++ny)
    for (int nx = std::max(0, x - 1); nx < std::min(columns, x + 2); ++nx)
      count += (nx != x || ny != y) && cells[ny * columns + nx];
  return count;
}

}  // namespace

// What a pair of images shows.
struct StillParts::Comparison {
  std::vector<Eigen::Vector2f> still, moved;  // places
  size_t staying = 0;  // points that look the same as just before, also for another reason
  Eigen::Vector2f motion{0, 0};  // of most that moved
  double share_alike = 0;        // of what moved, about so far and that way
};

size_t StillParts::CellAt(const Eigen::Vector2f& px) const {
  const int column = std::clamp(static_cast<int>(px.x() * kColumns) / width_, 0, kColumns - 1),
            row = std::clamp(static_cast<int>(px.y() * static_cast<float>(rows_)) / height_, 0,
                             rows_ - 1);
  return static_cast<size_t>(row) * kColumns + column;
}

StillParts::Comparison StillParts::Compare(const GreyPyramid& present) const {
  constexpr double kSame = 0.9, kOther = 0.8;  // correlations
  constexpr float kStays_px = 0.35F, kMoves_px = 1.5F;
  const GreyImage before = reference_->level(0), now = present.level(0);
  const CornerGrid grid{
      .cell = std::max(8, width_ / kColumns), .per_cell = 1, .max_points = kColumns * rows_};
  Comparison found;
  std::vector<std::pair<Eigen::Vector2f, double>> staying;  // with their correlation
  std::vector<Eigen::Vector2f> flow;
  std::vector<double> dx, dy;
  for (const Eigen::Vector2f& px : FindCorners(before, {}, grid)) {
    const double same = Correlation(before, px, now, px);
    if (same >= kSame) {
      const auto place = FollowPatch(*reference_, present, px, px, {.levels = 1});
      if (place && (*place - px).norm() < kStays_px) staying.emplace_back(px, same);
    } else if (same < kOther) {
      const auto place = FollowPatchBothWays(*reference_, present, px, px, {}, 0.7);
      if (!place || (*place - px).norm() < kMoves_px) continue;
      found.moved.push_back(px);
      flow.push_back(*place - px);
      dx.push_back(flow.back().x());
      dy.push_back(flow.back().y());
    }
  }
  if (flow.empty()) return found;
  found.motion = Eigen::Vector2d(Median(dx), Median(dy)).cast<float>();
  constexpr float kLeastShare = 0.25F;  // of the usual motion; what is near moves farther
  const float usual = found.motion.squaredNorm();
  const auto alike = std::ranges::count_if(
      flow, [&](const Eigen::Vector2f& d) { return d.dot(found.motion) > kLeastShare * usual; });
  found.share_alike = static_cast<double>(alike) / static_cast<double>(flow.size());
  found.staying = staying.size();
  // A camera may look at one place while it walks: seconds later that looks different. What repeats
  // itself may look the same although it moved with the rest.
  constexpr double kMargin = 0.1;
  for (const auto& [px, same] : staying)
    if (Correlation(before, px, now, px + found.motion) < same - kMargin &&
        Correlation(earlier_->level(0), px, now, px) >= kSame)
      found.still.push_back(px);
  return found;
}

bool StillParts::Add(const GreyImage& image, double time_s) {
  if (is_settled_ || (reference_ && time_s - compared_s_ < kLeastStep_s)) return false;
  compared_s_ = time_s;
  int halvings = 0;
  while (image.width >> halvings > kComparedWidth) ++halvings;
  GreyPyramid present;
  std::vector<GreyBuffer> halved;
  present.Set(image, halvings, kComparedLevels, halved);
  const auto take = [&] {
    if (!next_earlier_ || time_s - next_earlier_s_ > kEarlier_s) {
      earlier_ = std::exchange(next_earlier_, present);
      next_earlier_s_ = time_s;
    }
    reference_ = std::move(present);
    reference_s_ = time_s;
    return false;
  };
  if (!reference_ || !earlier_ || time_s - reference_s_ > kMostStep_s) {
    width_ = present.level(0).width;
    height_ = present.level(0).height;
    rows_ = std::max(1, kColumns * height_ / width_);
    cells_.resize(static_cast<size_t>(kColumns) * rows_);
    return take();
  }
  constexpr size_t kLeastMoved = 20;
  constexpr double kLeastMotion = 0.012;  // of the width: a turn of about a degree
  constexpr double kLeastAlike = 0.7;     // to one side: what is passed by moves to both
  constexpr double kLeastMoving = 0.55;   // of the points: a camera that stands sees others move
  const Comparison found = Compare(present);
  if (found.moved.size() >= kLeastMoved && found.motion.norm() < kLeastMotion * width_)
    return false;  // until the scene has moved farther
  const bool is_turn = found.moved.size() >= kLeastMoved && found.share_alike >= kLeastAlike &&
                       static_cast<double>(found.moved.size()) >=
                           kLeastMoving * static_cast<double>(found.moved.size() + found.staying);
  take();
  if (!is_turn) return false;
  if (count_ == 0) first_s_ = time_s;
  last_s_ = time_s;
  ++count_;
  constexpr size_t kKept = 64;
  motions_.push_back(found.motion.normalized());
  if (motions_.size() > kKept) motions_.erase(motions_.begin());
  for (const Eigen::Vector2f& px : found.still) ++cells_[CellAt(px)].still;
  for (const Eigen::Vector2f& px : found.moved) ++cells_[CellAt(px)].moved;
  return Decide();
}

std::vector<char> StillParts::StillCells() const {
  constexpr int kLeast = 4, kLeastRatio = 8;
  constexpr double kLeastShare = 0.3;  // of the images: corners are found in other cells, too
  std::vector<char> still(cells_.size());
  for (size_t i = 0; i < cells_.size(); ++i)
    still[i] = cells_[i].still >= std::max<double>(kLeast, kLeastShare * count_) &&
               cells_[i].still >= kLeastRatio * cells_[i].moved;
  return still;
}

bool StillParts::Decide() {
  constexpr int kLeastCount = 8, kEnough = 40;
  constexpr double kLeast_s = 2, kMostHidden = 0.5;
  constexpr size_t kLeastCells = 6;
  constexpr float kLeastTurn = 0.5F;  // cosine: a view from a train moves in one direction only
  if (count_ < kLeastCount || last_s_ - first_s_ < kLeast_s) return false;
  float least = 1;
  for (const Eigen::Vector2f& a : motions_)
    for (const Eigen::Vector2f& b : motions_) least = std::min(least, a.dot(b));
  if (least > kLeastTurn) return false;
  std::vector<char> hidden = StillCells();
  KeepLargeParts(kColumns, kLeastCells, hidden);
  // Cells without texture between, and a margin, since patches at the edge see both.
  constexpr int kBetween = 3;
  for (const int neighbours : {kBetween, kBetween, 1}) {
    const std::vector<char> before = hidden;
    for (size_t i = 0; i < hidden.size(); ++i)
      if (!before[i] && cells_[i].moved <= cells_[i].still &&
          NeighboursIn(before, kColumns, i) >= neighbours)
        hidden[i] = 1;
  }
  GreyBuffer visible(kColumns, rows_);
  size_t count = 0;
  for (int y = 0; y < rows_; ++y)
    for (int x = 0; x < kColumns; ++x) {
      const bool is_hidden = hidden[y * kColumns + x] != 0;
      visible.Row(y)[x] = is_hidden ? 0 : 255;
      count += is_hidden;
    }
  if (static_cast<double>(count) > kMostHidden * static_cast<double>(hidden.size())) return false;
  ImageMask mask = count > 0 ? ImageMask(visible.view()) : ImageMask();
  const bool is_new = std::abs(mask.HiddenShare() - mask_.HiddenShare()) > 0.02;
  if (is_new) mask_ = std::move(mask);
  is_settled_ = count_ >= kEnough && mask_.HiddenShare() == 0;
  return is_new;
}

std::string Describe(const ImageMask& mask) {
  double x = 0, y = 0, count = 0;
  constexpr int kSteps = 64;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double u = (i + 0.5) / kSteps, v = (j + 0.5) / kSteps;
      if (!mask.Hides(u, v)) continue;
      x += u, y += v, ++count;
    }
  x = count > 0 ? x / count - 0.5 : 0;
  y = count > 0 ? y / count - 0.5 : 0;
  constexpr double kAside = 0.2;
  std::string where = "in the middle";
  if (std::max(std::abs(x), std::abs(y)) > kAside)
    where = std::abs(y) >= std::abs(x) ? (y > 0 ? "at the bottom" : "at the top")
                                       : (x > 0 ? "at the right" : "at the left");
  return fmt::format("{:.0f} % of the image, {}", 100 * mask.HiddenShare(), where);
}

}  // namespace oaslam
