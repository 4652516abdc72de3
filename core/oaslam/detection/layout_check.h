#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/detection/yolo_output.h"

namespace oaslam {

// Checks whether what a network gives fits the layout that was recognised: networks for other tasks
// have outputs of the same shape.
class LayoutCheck {
 public:
  // The problem that this output or the outputs so far show, "a score of 290.5, allowed: 0 to 1";
  // empty where there is none. A score outside of 0 to 1 is one in every image; boxes only where
  // most of those of the first images are outside of the input, smaller than a pixel or of no
  // class. `candidates`: of DecodeCandidates, of the same output.
  std::string Add(const cv::Mat& output, const OutputFormat& format, const cv::Size& network_size,
                  const std::vector<Candidate>& candidates);

 private:
  int images_ = 0;          // with candidates, of the first ones
  int good_ = 0, bad_ = 0;  // candidates in them
};

}  // namespace oaslam
