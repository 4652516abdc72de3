#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "oaslam/detection/onnx_info.h"
#include "oaslam/detector.h"
#include "oaslam/types.h"

namespace oaslam {

// The layout of one output tensor, its number of classes (0: unknown) and of mask coefficients
// behind them (a segmenting model).
struct OutputFormat {
  DetectorLayout layout = DetectorLayout::kAuto;
  int classes = 0;
  int masks = 0;
  bool is_transposed = false;  // kYolov8 with a row for each candidate, as all other layouts have
  bool has_class = false;      // kRtDetr with score and class instead of the scores of all classes
  bool has_angle = false;      // boxes are oriented: the last number of each is its angle, radians
};

// The numbers of the candidates in an output, whichever way round it is.
struct Candidates {
  const float* data = nullptr;
  int count = 0, numbers = 0;  // candidates; numbers of each
  size_t next = 0, step = 0;   // floats from a candidate, and from a number, to the next

  float operator()(int candidate, int number) const {
    return data[static_cast<size_t>(candidate) * next + static_cast<size_t>(number) * step];
  }
};
// None where the output is no matrix.
Candidates CandidatesOf(const cv::Mat& output, const OutputFormat& format);

// Whether each candidate has one score and its class; a list has as many rows as there are boxes,
// or is filled up.
bool IsListed(const OutputFormat& format);

// The numbers of a candidate that are scores between 0 and 1: [first, end).
struct ScoreNumbers {
  int first = 0, end = 0;
};
ScoreNumbers ScoresOf(const OutputFormat& format);

// A detection and its place in the output: the row, or the column of kYolov8.
struct Candidate : Detection {
  int place = 0;
};

// Recognises the layout of an output of the network by its shape, its metadata, the unit of its
// boxes and a second output of prototypes (`masks`: their number, 0: none); nothing where the
// output is not that of a detector. If `wanted` is not kAuto it is only checked against the shape.
std::optional<OutputFormat> RecognizeOutput(const cv::Mat& output, const cv::Size& network_size,
                                            DetectorLayout wanted, const HeadMetadata& head,
                                            int masks = 0);

// Decodes the candidates with score > min_score of one output (float, batch of one), with boxes in
// network pixels, in the order of the tensor. Where the layout has scores of all classes, they have
// up to three other labels. A class that is no whole number becomes -1; boxes may be empty or not
// finite.
std::vector<Candidate> DecodeCandidates(const cv::Mat& output, const OutputFormat& format,
                                        const cv::Size& network_size, double min_score);
// Whether a candidate has a class and a box.
bool IsUsable(const Detection& detection);
// The candidates that are usable.
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
