#include "oaslam/detection/yolo_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/dnn.hpp>
#include <utility>

#include "oaslam/geometry/box.h"
#include "oaslam/util/check.h"
#include "oaslam/util/named.h"

namespace oaslam {
namespace {

constexpr std::array<int, 3> kStrides{8, 16, 32};  // of the grids, in pixels of the input
// An end-to-end export has a few hundred rows; a one-class YOLOv5, whose rows have six columns,
// too, has thousands.
constexpr int kMaxEndToEndRows = 1000;
constexpr Named<DetectorLayout> kLayouts[] = {{DetectorLayout::kAuto, "auto"},
                                              {DetectorLayout::kYolox, "yolox"},
                                              {DetectorLayout::kYolov5, "yolov5"},
                                              {DetectorLayout::kYolov8, "yolov8"},
                                              {DetectorLayout::kEndToEnd, "end2end"}};

int GridCells(const cv::Size& size) {
  int cells = 0;
  for (const int stride : kStrides) cells += (size.width / stride) * (size.height / stride);
  return cells;
}

// rows x columns of an output [1, rows, columns] or [rows, columns].
std::optional<std::pair<int, int>> RowsAndColumns(const std::vector<int>& shape) {
  if (shape.size() == 3 && shape[0] == 1) return std::pair{shape[1], shape[2]};
  if (shape.size() == 2) return std::pair{shape[0], shape[1]};
  return std::nullopt;
}

// The columns after the classes are mask coefficients of a segmentation model; their number follows
// from the prototypes, or from the number of class names.
int ClassCount(int columns, int first_class, int named_classes, int masks) {
  const int classes = columns - first_class - masks;
  return named_classes > 0 && named_classes < classes ? named_classes : classes;
}

// The number of rows, one or three anchors in every cell of all grids or of fewer grids, is a
// multiple of the number of cells of the coarsest grid (stride 32, or 64 in large models). Other
// networks are rejected by this.
bool FillsGrids(int candidates, const cv::Size& network_size) {
  for (const int stride : {32, 64}) {
    const int cells = (network_size.width / stride) * (network_size.height / stride);
    if (cells > 0 && candidates >= cells && candidates % cells == 0) return true;
  }
  return false;
}

DetectorLayout GuessLayout(int rows, int columns, const cv::Size& network_size, bool end_to_end,
                           int masks) {
  if (columns == 6 + masks && (end_to_end || rows <= kMaxEndToEndRows))
    return DetectorLayout::kEndToEnd;
  if (columns > rows) return DetectorLayout::kYolov8;
  return rows == GridCells(network_size) ? DetectorLayout::kYolox : DetectorLayout::kYolov5;
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

bool IsUsable(const Detection& d, double min_score) {
  return std::isfinite(d.score) && d.score > min_score &&
         std::isfinite(d.box.x1 + d.box.y1 + d.box.x2 + d.box.y2) && d.box.Area() > 0;
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
        if (!IsUsable(d, min_score)) continue;
        d.other_labels = OtherLabels(scores, best, r[4]);
        found.push_back({std::move(d), row});
      }
    }
  }
  return found;
}

std::vector<Candidate> DecodeYolov5(const cv::Mat& rows, int classes, double min_score) {
  std::vector<Candidate> found;
  for (int i = 0; i < rows.rows; ++i) {
    const float* r = rows.ptr<float>(i);
    if (!(r[4] > min_score)) continue;
    const ClassScores scores{r + 5, classes};
    const int best = BestClass(scores);
    Detection d{.category_id = best,
                .score = r[4] * scores[best],
                .box = CenterBox(r[0], r[1], r[2], r[3])};
    if (!IsUsable(d, min_score)) continue;
    d.other_labels = OtherLabels(scores, best, r[4]);
    found.push_back({std::move(d), i});
  }
  return found;
}

std::vector<Candidate> DecodeYolov8(const cv::Mat& columns, int classes, double min_score) {
  std::vector<Candidate> found;
  const size_t step = columns.step1();
  for (int i = 0; i < columns.cols; ++i) {
    const float* c = columns.ptr<float>(0) + i;
    const ClassScores scores{c + 4 * step, classes, step};
    const int best = BestClass(scores);
    Detection d{.category_id = best,
                .score = scores[best],
                .box = CenterBox(c[0], c[step], c[2 * step], c[3 * step])};
    if (!IsUsable(d, min_score)) continue;
    d.other_labels = OtherLabels(scores, best, 1);
    found.push_back({std::move(d), i});
  }
  return found;
}

std::vector<Candidate> DecodeEndToEnd(const cv::Mat& rows, double min_score) {
  std::vector<Candidate> found;
  for (int i = 0; i < rows.rows; ++i) {
    const float* r = rows.ptr<float>(i);
    const Detection d{.category_id = static_cast<int>(std::lround(r[5])),
                      .score = r[4],
                      .box = {r[0], r[1], r[2], r[3]}};
    if (IsUsable(d, min_score) && d.category_id >= 0) found.push_back({d, i});
  }
  return found;
}

cv::Mat AsMatrix(const cv::Mat& output) {
  OASLAM_CHECK(output.depth() == CV_32F && output.isContinuous() && output.dims >= 2);
  return {output.size[output.dims - 2], output.size[output.dims - 1], CV_32F,
          const_cast<uchar*>(output.data)};
}

}  // namespace

const char* ToString(DetectorLayout layout) { return NameIn(kLayouts, layout); }

std::optional<DetectorLayout> DetectorLayoutFromString(const std::string& name) {
  return ValueIn(kLayouts, name);
}

std::optional<OutputFormat> RecognizeOutput(const std::vector<int>& shape,
                                            const cv::Size& network_size, DetectorLayout wanted,
                                            int named_classes, bool end_to_end, int masks) {
  const auto size = RowsAndColumns(shape);
  if (!size) return std::nullopt;
  const auto [rows, columns] = *size;
  const DetectorLayout layout = wanted == DetectorLayout::kAuto
                                    ? GuessLayout(rows, columns, network_size, end_to_end, masks)
                                    : wanted;
  switch (layout) {
    case DetectorLayout::kYolox:
      if (rows != GridCells(network_size) || columns < 6 + masks) return std::nullopt;
      return OutputFormat{layout, ClassCount(columns, 5, named_classes, masks), masks};
    case DetectorLayout::kYolov5:
      if (columns < 6 + masks || !FillsGrids(rows, network_size)) return std::nullopt;
      return OutputFormat{layout, ClassCount(columns, 5, named_classes, masks), masks};
    case DetectorLayout::kYolov8:
      if (rows < 5 + masks || !FillsGrids(columns, network_size)) return std::nullopt;
      return OutputFormat{layout, ClassCount(rows, 4, named_classes, masks), masks};
    case DetectorLayout::kEndToEnd:
      if (columns != 6 + masks) return std::nullopt;
      return OutputFormat{layout, named_classes, masks};
    case DetectorLayout::kAuto:
      break;
  }
  return std::nullopt;
}

std::vector<Candidate> DecodeOutput(const cv::Mat& output, const OutputFormat& format,
                                    const cv::Size& network_size, double min_score) {
  const cv::Mat matrix = AsMatrix(output);
  switch (format.layout) {
    case DetectorLayout::kAuto:
      break;
    case DetectorLayout::kYolox:
      return DecodeYolox(matrix, format.classes, network_size, min_score);
    case DetectorLayout::kYolov5:
      return DecodeYolov5(matrix, format.classes, min_score);
    case DetectorLayout::kYolov8:
      return DecodeYolov8(matrix, format.classes, min_score);
    case DetectorLayout::kEndToEnd:
      return DecodeEndToEnd(matrix, min_score);
  }
  OASLAM_CHECK(format.layout != DetectorLayout::kAuto);
  return {};
}

std::vector<float> MaskCoefficients(const cv::Mat& output, const OutputFormat& format, int place) {
  const cv::Mat matrix = AsMatrix(output);
  std::vector<float> coefficients;
  for (int i = 0; i < format.masks; ++i)
    coefficients.push_back(format.layout == DetectorLayout::kYolov8
                               ? matrix.at<float>(matrix.rows - format.masks + i, place)
                               : matrix.at<float>(place, matrix.cols - format.masks + i));
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
