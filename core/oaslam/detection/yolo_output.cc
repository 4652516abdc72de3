#include "oaslam/detection/yolo_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/dnn.hpp>
#include <tuple>
#include <utility>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/util/check.h"
#include "oaslam/util/named.h"

namespace oaslam {
namespace {

constexpr std::array<int, 3> kStrides{8, 16, 32};  // of the grids, in pixels of the input
// An end-to-end export has a few hundred rows; a one-class YOLOv5, whose rows have six columns,
// too, has thousands.
constexpr int kMaxEndToEndRows = 1000;
constexpr Named<DetectorLayout> kLayouts[] = {
    {DetectorLayout::kAuto, "auto"},        {DetectorLayout::kYolox, "yolox"},
    {DetectorLayout::kYolov5, "yolov5"},    {DetectorLayout::kYolov8, "yolov8"},
    {DetectorLayout::kEndToEnd, "end2end"}, {DetectorLayout::kRtDetr, "rtdetr"}};

int GridCells(const cv::Size& size) {
  int cells = 0;
  for (const int stride : kStrides) cells += (size.width / stride) * (size.height / stride);
  return cells;
}

// The matrix of an output [1, rows, columns] or [rows, columns]; nothing for other shapes.
std::optional<cv::Mat> MatrixOf(const cv::Mat& output) {
  if (output.dims != 2 && !(output.dims == 3 && output.size[0] == 1)) return std::nullopt;
  OASLAM_CHECK(output.depth() == CV_32F && output.isContinuous());
  return cv::Mat(output.size[output.dims - 2], output.size[output.dims - 1], CV_32F,
                 const_cast<uchar*>(output.data));
}

// The columns after the classes, `rest`, are no scores; their number follows from the prototypes
// and the metadata, or from the number of class names.
int ClassCount(int columns, int first_class, int named_classes, int rest) {
  const int classes = columns - first_class - rest;
  return named_classes > 0 && named_classes < classes ? named_classes : classes;
}

// Whether the number of candidates is that of a few anchors in every cell of one or several
// successive grids. Other networks are rejected by this.
bool FillsGrids(int candidates, const cv::Size& network_size) {
  constexpr std::array kAllStrides{4, 8, 16, 32, 64};
  constexpr int kMostAnchors = 9;
  for (size_t first = 0; first + 1 < kAllStrides.size(); ++first) {
    int cells = 0;
    for (size_t i = first; i < kAllStrides.size(); ++i) {
      cells += (network_size.width / kAllStrides[i]) * (network_size.height / kAllStrides[i]);
      if (cells > 0 && candidates % cells == 0 && candidates >= cells &&
          candidates / cells <= kMostAnchors)
        return true;
    }
  }
  return false;
}

// The unit of the boxes. Offsets in cells, as YOLOX has them, are kOther.
enum class BoxUnit { kUnknown, kShares, kPixels, kOther };

BoxUnit UnitOf(const Candidates& in, const cv::Size& network_size) {
  if (in.numbers < 4) return BoxUnit::kUnknown;
  constexpr float kRounding = 1e-3F;
  float largest = 0;  // coordinate of a centre or corner
  bool are_shares = true;
  for (int i = 0; i < in.count; ++i) {
    for (const int k : {0, 1})
      if (std::isfinite(in(i, k))) largest = std::max(largest, std::abs(in(i, k)));
    for (int k = 0; k < 4; ++k)
      are_shares = are_shares && in(i, k) >= -kRounding && in(i, k) <= 1 + kRounding;
  }
  if (largest == 0) return BoxUnit::kUnknown;
  if (are_shares) return BoxUnit::kShares;
  // Candidates are all over the input, while an offset is a few cells at most.
  constexpr float kPart = 0.25F;
  const auto side = static_cast<float>(std::min(network_size.width, network_size.height));
  return largest > kPart * side ? BoxUnit::kPixels : BoxUnit::kOther;
}

bool AreCorners(const Candidates& in) {
  for (int i = 0; i < in.count; ++i)
    if (in(i, 2) < in(i, 0) || in(i, 3) < in(i, 1)) return false;
  return true;
}

bool AreWhole(const Candidates& in, int number) {
  for (int i = 0; i < in.count; ++i)
    if (in(i, number) != std::round(in(i, number))) return false;
  return true;
}

// What is known of an output before its layout.
struct OutputFacts {
  Candidates rows;  // each row as a candidate
  cv::Size network_size;
  const HeadMetadata& head;
  int masks = 0, rest = 0;  // numbers of a candidate: mask coefficients; all that are no scores

  // The number of classes that the names tell; they may skip some.
  int names() const {
    return head.names.empty() ? 0 : std::min(head.names.rbegin()->first, kMaxCategory) + 1;
  }
  bool FillsGridsBy(int candidates) const { return FillsGrids(candidates, network_size); }
  // Rows of a box with its score, its class and perhaps more.
  bool AreListed() const {
    const bool has_known_rest = head.task == "pose" || head.task == "segment";
    return rows.numbers == 6 + rest || (has_known_rest && rows.numbers >= 6 + masks &&
                                        !FillsGridsBy(rows.count) && !FillsGridsBy(rows.numbers));
  }
};

// The layout without its numbers of classes.
OutputFormat Guess(const OutputFacts& facts) {
  constexpr int kClassesOfCoco = 80;  // of a network without names
  const auto [rows, columns] = std::pair{facts.rows.count, facts.rows.numbers};
  const bool are_few = rows <= kMaxEndToEndRows;
  const BoxUnit unit = UnitOf(facts.rows, facts.network_size);
  const int names = facts.names(), scores = columns - 4 - facts.rest;
  if (facts.head.is_rt_detr) return {DetectorLayout::kRtDetr};
  if (facts.AreListed() && (facts.head.is_suppressed || are_few))
    return {unit == BoxUnit::kShares && facts.rest == 0 && !AreCorners(facts.rows)
                ? DetectorLayout::kRtDetr
                : DetectorLayout::kEndToEnd};
  if (columns > rows) return {DetectorLayout::kYolov8};
  const bool may_be_shares =
      unit == BoxUnit::kShares || (unit == BoxUnit::kUnknown && !facts.FillsGridsBy(rows));
  if (are_few && may_be_shares && (names == 0 ? unit == BoxUnit::kShares : scores == names))
    return {DetectorLayout::kRtDetr};
  const bool is_one_anchor = rows == GridCells(facts.network_size);
  if (scores == 1 || (names > 0 && scores == names) ||
      (names == 0 && is_one_anchor && unit == BoxUnit::kPixels && scores == kClassesOfCoco))
    return {.layout = DetectorLayout::kYolov8, .is_transposed = true};
  return {is_one_anchor ? DetectorLayout::kYolox : DetectorLayout::kYolov5};
}

struct ClassScores {
  const float* first = nullptr;
  int count = 0;
  size_t step = 1;

  float operator[](int c) const { return first[static_cast<size_t>(c) * step]; }
};

int BestClass(const ClassScores& scores) {
  int best = 0;
  for (int c = 1; c < scores.count; ++c)
    if (scores[c] > scores[best]) best = c;
  return best;
}

// The classes next to the best one, the best of them first. `objectness`: factor of all scores.
std::vector<Label> OtherLabels(const ClassScores& scores, int best, float objectness) {
  constexpr float kShareOfBest = 0.2F;  // below it a class says nothing
  constexpr size_t kMost = 3;           // a network confuses few classes with one another
  std::vector<Label> labels;
  for (int c = 0; c < scores.count; ++c)
    if (c != best && scores[c] > kShareOfBest * scores[best])
      labels.push_back({c, objectness * scores[c]});
  std::ranges::stable_sort(labels, std::greater(), &Label::score);
  labels.resize(std::min(labels.size(), kMost));
  return labels;
}

Box CenterBox(double cx, double cy, double w, double h) {
  return {cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2};
}

// The centre of a YOLOX row is an offset from its grid cell, in cells; its size the logarithm of
// cells (Ge et al. 2021, section 2).
std::vector<Candidate> DecodeYolox(const cv::Mat& rows, int classes, const cv::Size& network_size,
                                   double min_score) {
  std::vector<Candidate> found;
  int row = 0;
  for (const int stride : kStrides) {
    for (int y = 0; y < network_size.height / stride; ++y) {
      for (int x = 0; x < network_size.width / stride; ++x, ++row) {
        const float* r = rows.ptr<float>(row);
        const ClassScores scores{r + 5, classes};
        const int best = BestClass(scores);
        Detection d{
            .category_id = best,
            .score = r[4] * scores[best],
            .box = CenterBox(stride * (x + double{r[0]}), stride * (y + double{r[1]}),
                             stride * std::exp(double{r[2]}), stride * std::exp(double{r[3]}))};
        if (!(d.score > min_score)) continue;
        d.other_labels = OtherLabels(scores, best, r[4]);
        found.push_back({std::move(d), row});
      }
    }
  }
  return found;
}

// The box of a candidate of any other layout.
Box BoxOf(const Candidates& in, int i, const OutputFormat& format, const cv::Size& network_size) {
  if (format.layout == DetectorLayout::kEndToEnd && !format.has_angle)
    return {in(i, 0), in(i, 1), in(i, 2), in(i, 3)};
  const bool are_shares = format.layout == DetectorLayout::kRtDetr;
  const double x = are_shares ? network_size.width : 1, y = are_shares ? network_size.height : 1;
  double width = x * in(i, 2), height = y * in(i, 3);
  if (format.has_angle) {
    const double angle = in(i, in.numbers - 1);
    const double c = std::abs(std::cos(angle)), s = std::abs(std::sin(angle));
    std::tie(width, height) = std::pair{c * width + s * height, s * width + c * height};
  }
  return CenterBox(x * in(i, 0), y * in(i, 1), width, height);
}

std::vector<Candidate> DecodeScores(const Candidates& in, const OutputFormat& format,
                                    const cv::Size& network_size, double min_score) {
  const bool has_objectness = format.layout == DetectorLayout::kYolov5;
  std::vector<Candidate> found;
  for (int i = 0; i < in.count; ++i) {
    const float objectness = has_objectness ? in(i, 4) : 1;
    if (!(objectness > min_score)) continue;
    const ClassScores scores{
        &in.data[static_cast<size_t>(i) * in.next + (has_objectness ? 5 : 4) * in.step],
        format.classes, in.step};
    const int best = BestClass(scores);
    Detection d{.category_id = best,
                .score = objectness * scores[best],
                .box = BoxOf(in, i, format, network_size)};
    if (!(d.score > min_score)) continue;
    d.other_labels = OtherLabels(scores, best, objectness);
    found.push_back({std::move(d), i});
  }
  return found;
}

std::vector<Candidate> DecodeListed(const Candidates& in, const OutputFormat& format,
                                    const cv::Size& network_size, double min_score) {
  std::vector<Candidate> found;
  for (int i = 0; i < in.count; ++i) {
    if (!(in(i, 4) > min_score)) continue;
    const float category = in(i, 5);
    // Networks of 8 bits round.
    constexpr float kRounding = 0.05F;
    const bool is_class = category > -0.5F && category <= kMaxCategory &&
                          std::abs(category - std::round(category)) < kRounding;
    found.push_back({{.category_id = is_class ? static_cast<int>(std::round(category)) : -1,
                      .score = in(i, 4),
                      .box = BoxOf(in, i, format, network_size)},
                     i});
  }
  return found;
}

}  // namespace

const char* ToString(DetectorLayout layout) { return NameIn(kLayouts, layout); }

std::optional<DetectorLayout> DetectorLayoutFromString(const std::string& name) {
  return ValueIn(kLayouts, name);
}

Candidates CandidatesOf(const cv::Mat& output, const OutputFormat& format) {
  const std::optional<cv::Mat> matrix = MatrixOf(output);
  if (!matrix) return {};
  const auto columns = static_cast<size_t>(matrix->cols);
  const float* const data = matrix->ptr<float>();
  if (format.layout == DetectorLayout::kYolov8 && !format.is_transposed)
    return {data, matrix->cols, matrix->rows, 1, columns};
  return {data, matrix->rows, matrix->cols, columns, 1};
}

bool IsListed(const OutputFormat& format) {
  return format.layout == DetectorLayout::kEndToEnd || format.has_class;
}

ScoreNumbers ScoresOf(const OutputFormat& format) {
  if (IsListed(format)) return {4, 5};
  const bool has_objectness =
      format.layout == DetectorLayout::kYolox || format.layout == DetectorLayout::kYolov5;
  return {4, (has_objectness ? 5 : 4) + format.classes};
}

std::optional<OutputFormat> RecognizeOutput(const cv::Mat& output, const cv::Size& network_size,
                                            DetectorLayout wanted, const HeadMetadata& head,
                                            int masks) {
  if (!MatrixOf(output)) return std::nullopt;
  const bool has_angle = head.task == "obb";
  const OutputFacts facts{CandidatesOf(output, {}), network_size, head, masks,
                          masks + (head.task == "pose" ? head.keypoint_values : 0) + has_angle};
  const auto [rows, columns] = std::pair{facts.rows.count, facts.rows.numbers};
  OutputFormat format{wanted};
  if (wanted == DetectorLayout::kAuto)
    format = Guess(facts);
  else if (wanted == DetectorLayout::kYolov8)
    format.is_transposed = !facts.FillsGridsBy(columns);
  format.masks = masks;
  format.has_angle = has_angle;
  const int numbers = CandidatesOf(output, format).numbers;
  const int candidates = CandidatesOf(output, format).count;
  int first_class = 4;
  switch (format.layout) {
    case DetectorLayout::kYolox:
      if (rows != GridCells(network_size)) return std::nullopt;
      first_class = 5;
      break;
    case DetectorLayout::kYolov5:
      first_class = 5;
      [[fallthrough]];
    case DetectorLayout::kYolov8:
      if (!facts.FillsGridsBy(candidates)) return std::nullopt;
      if (format.is_transposed &&
          (UnitOf(facts.rows, network_size) == BoxUnit::kOther ||
           (facts.names() > 0 && columns != 4 + facts.names() + facts.rest)))
        return std::nullopt;
      break;
    case DetectorLayout::kEndToEnd:
      if (!facts.AreListed()) return std::nullopt;
      format.classes = facts.names();
      return format;
    case DetectorLayout::kRtDetr:
      format.has_class = columns == 6 && AreWhole(facts.rows, 5);
      break;
    case DetectorLayout::kAuto:
      return std::nullopt;
  }
  if (numbers < first_class + 1 + facts.rest) return std::nullopt;
  format.classes = format.has_class ? facts.names()
                                    : ClassCount(numbers, first_class, facts.names(), facts.rest);
  return format;
}

bool IsUsable(const Detection& d) {
  return d.category_id >= 0 && std::isfinite(d.score) &&
         std::isfinite(d.box.x1 + d.box.y1 + d.box.x2 + d.box.y2) && d.box.Area() > 0;
}

std::vector<Candidate> DecodeCandidates(const cv::Mat& output, const OutputFormat& format,
                                        const cv::Size& network_size, double min_score) {
  OASLAM_CHECK(format.layout != DetectorLayout::kAuto);
  if (format.layout == DetectorLayout::kYolox)
    return DecodeYolox(MatrixOf(output).value(), format.classes, network_size, min_score);
  const Candidates candidates = CandidatesOf(output, format);
  return IsListed(format) ? DecodeListed(candidates, format, network_size, min_score)
                          : DecodeScores(candidates, format, network_size, min_score);
}

std::vector<Candidate> DecodeOutput(const cv::Mat& output, const OutputFormat& format,
                                    const cv::Size& network_size, double min_score) {
  std::vector<Candidate> found = DecodeCandidates(output, format, network_size, min_score);
  std::erase_if(found, [](const Candidate& candidate) { return !IsUsable(candidate); });
  return found;
}

std::vector<float> MaskCoefficients(const cv::Mat& output, const OutputFormat& format, int place) {
  const Candidates candidates = CandidatesOf(output, format);
  std::vector<float> coefficients;
  for (int i = 0; i < format.masks; ++i)
    coefficients.push_back(candidates(place, candidates.numbers - format.masks + i));
  return coefficients;
}

std::vector<Candidate> JoinLabels(const std::vector<Candidate>& candidates) {
  constexpr double kSameBox = 0.7;  // IoU; boxes of different things rarely agree as well
  std::vector<Candidate> joined;
  for (const Candidate& candidate : candidates) {
    const auto label_of = [&](Candidate& better) {
      return IoU(better.box, candidate.box) < kSameBox
                 ? better.other_labels.end()
                 : std::ranges::find(better.other_labels, candidate.category_id,
                                     &Label::category_id);
    };
    const auto same = std::ranges::find_if(
        joined, [&](Candidate& better) { return label_of(better) != better.other_labels.end(); });
    if (same == joined.end())
      joined.push_back(candidate);
    else
      label_of(*same)->score = std::max(label_of(*same)->score, candidate.score);
  }
  return joined;
}

std::vector<Candidate> SuppressPerClass(const std::vector<Candidate>& candidates, double max_iou) {
  std::map<int, std::vector<Candidate>> by_class;
  for (const Candidate& c : candidates) by_class[c.category_id].push_back(c);
  std::vector<Candidate> kept;
  for (const auto& [category, rivals] : by_class) {
    std::vector<cv::Rect2d> boxes;
    std::vector<float> scores;
    for (const Detection& d : rivals) {
      boxes.emplace_back(d.box.x1, d.box.y1, d.box.Width(), d.box.Height());
      scores.push_back(static_cast<float>(d.score));
    }
    std::vector<int> indices;
    cv::dnn::NMSBoxes(boxes, scores, 0.0F, static_cast<float>(max_iou), indices);
    for (const int i : indices) kept.push_back(rivals[static_cast<size_t>(i)]);
  }
  std::ranges::stable_sort(
      kept, [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  return kept;
}

}  // namespace oaslam
