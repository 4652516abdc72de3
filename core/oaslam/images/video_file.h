#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/formats/unfinished_file.h"

namespace cv {
class VideoWriter;
}

namespace oaslam {

// Writes pictures as a video: H.264, or MPEG-4 Part 2 where there is no encoder for it, in MP4. Its
// rate is constant, that of the first pictures' time stamps.
class VideoFile {
 public:
  // Throws InputError where the file is not .mp4, its folder is missing, or it cannot be written.
  explicit VideoFile(const std::string& path);
  // Finishes the file if Finish was not called; errors are not reported.
  ~VideoFile();
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // Adds a picture, 8-bit BGR, all of the same size. `timestamp`: seconds, ascending. Throws
  // InputError as the constructor does.
  void Add(const cv::Mat& picture, double timestamp);
  // Completes the file; without any picture an existing file is kept. Throws InputError where it
  // could not be written.
  void Finish();

 private:
  void Open();
  void Write(const cv::Mat& picture);

  std::string path_;
  UnfinishedFile written_;
  std::vector<cv::Mat> first_;  // pictures kept until the rate is known
  std::vector<double> timestamps_;
  std::unique_ptr<cv::VideoWriter> writer_;
  int count_ = 0;  // pictures written
  bool finished_ = false;
};

// Pictures a second by the median of the intervals, in [1, 60]; 30 where there is none.
double FrameRateOf(const std::vector<double>& timestamps);

}  // namespace oaslam
