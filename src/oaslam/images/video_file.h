#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace cv {
class VideoWriter;
}

namespace oaslam {

// Writes pictures as a video: H.264, or MPEG-4 Part 2 where there is no encoder for it, in MP4. Its
// rate is constant, that of the first pictures' time stamps.
class VideoFile {
 public:
  // Throws InputError: not .mp4, the folder is not there, cannot be written.
  explicit VideoFile(const std::string& path);
  // Finishes, and cannot say what went wrong.
  ~VideoFile();
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // A picture, 8-bit BGR, all of the same size. `timestamp`: seconds, ascending. Throws InputError
  // as the constructor.
  void Add(const cv::Mat& picture, double timestamp);
  // Makes the file whole; without a picture an older one stays. Throws InputError: it could not be
  // written.
  void Finish();

 private:
  void Open();
  void Write(const cv::Mat& picture);

  std::string path_, written_path_;  // it is written beside, and renamed when it is whole
  std::vector<cv::Mat> first_;       // until the rate is known
  std::vector<double> timestamps_;
  std::unique_ptr<cv::VideoWriter> writer_;
  int count_ = 0;  // pictures written
  bool finished_ = false;
};

// Pictures a second by the median of the intervals, in [1, 60]; 30 where there is none.
double FrameRateOf(const std::vector<double>& timestamps);

}  // namespace oaslam
