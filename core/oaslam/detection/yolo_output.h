#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "oaslam/detector.h"
#include "oaslam/types.h"

namespace oaslam {

// The layout of one output tensor, its number of classes (0: unknown) and of mask coefficients
// behind them (a segmenting model).
struct OutputFormat {
  DetectorLayout layout = DetectorLayout::kAuto;
  int classes = 0;
  int masks = 0;
};

// A detection and its place in the output: the row, or the column of kYolov8.
struct Candidate : Detection {
  int place = 0;
};

// Recognises the layout from the shape of an output, the input size, the metadata (`named_classes`:
// number of class names in the file, 0: unknown) and a second output of prototypes (`masks`: their
// number, 0: none); nothing where the output is not that of a detector. If `wanted` is not kAuto it
// is only checked against the shape.
std::optional<OutputFormat> RecognizeOutput(const std::vector<int>& shape,
                                            const cv::Size& network_size, DetectorLayout wanted,
                                            int named_classes, bool end_to_end, int masks = 0);

// Decodes the candidates with score > min_score of one output (float, batch of one), with boxes in
// network pixels, in the order of the tensor.
// Where the layout has scores of all classes, they have up to three other labels.
std::vector<Candidate> DecodeOutput(const cv::Mat& output, const OutputFormat& format,
                                    const cv::Size& network_size, double min_score);

// The mask coefficients of a candidate, format.masks of them.
std::vector<float> MaskCoefficients(const cv::Mat& output, const OutputFormat& format, int place);

// Non-maximum suppression within each class; best scores first.
std::vector<Candidate> SuppressPerClass(const std::vector<Candidate>& candidates, double max_iou);

// Joins two candidates with nearly the same box, if the class of the one with the lower score is
// among the other labels of the better one: drops the former, and raises the score of that label.
// `candidates`: best scores first, and so is the result.
std::vector<Candidate> JoinLabels(const std::vector<Candidate>& candidates);

}  // namespace oaslam
