#pragma once

#include <opencv2/core/utils/logger.hpp>

namespace oaslam {

// Silences OpenCV's log while this object exists, since OpenCV writes to stderr also the errors
// that it returns to its caller.
class QuietOpenCv {
 public:
  QuietOpenCv() = default;
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(before_); }
  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;

 private:
  cv::utils::logging::LogLevel before_ =
      cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
};

}  // namespace oaslam
