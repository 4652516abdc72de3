#pragma once

#include <opencv2/core/utils/logger.hpp>

namespace oaslam {

// Silences OpenCV while it exists: it writes to stderr, too, what it tells its caller.
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
