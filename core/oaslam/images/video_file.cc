#include "oaslam/images/video_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>
#include <utility>

#include "oaslam/images/quiet_opencv.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/check.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// Pictures that determine the rate; their median interval is robust against a few pauses.
constexpr size_t kFirst = 16;

// Repeats the last row or column of a picture with odd sides: encoders halve the resolution of
// colours and need even sides.
cv::Mat WithEvenSides(const cv::Mat& picture) {
  if (picture.cols % 2 == 0 && picture.rows % 2 == 0) return picture;
  cv::Mat even;
  cv::copyMakeBorder(picture, even, 0, picture.rows % 2, 0, picture.cols % 2, cv::BORDER_REPLICATE);
  return even;
}

int FramesIn(const std::string& path) {
  const QuietOpenCv quiet;
  const cv::VideoCapture video(path);
  return video.isOpened() ? static_cast<int>(std::lround(video.get(cv::CAP_PROP_FRAME_COUNT))) : 0;
}

}  // namespace

double FrameRateOf(const std::vector<double>& timestamps) {
  // Players stutter beyond these; 30 is the rate of most cameras.
  constexpr double kLowest = 1, kHighest = 60, kUnknown = 30;
  std::vector<double> intervals;
  for (size_t i = 1; i < timestamps.size(); ++i)
    intervals.push_back(timestamps[i] - timestamps[i - 1]);
  if (intervals.empty()) return kUnknown;
  const double interval = Median(std::move(intervals));
  if (!(interval > 0)) return kUnknown;
  // Some encoders accept only two decimals.
  return std::round(100 * std::clamp(1 / interval, kLowest, kHighest)) / 100;
}

VideoFile::VideoFile(const std::string& path)
    : path_(path),
      // Of a relative path, a colon may end the name of a protocol.
      written_(fs::absolute(path).string(), ".tmp.mp4") {
  if (fs::path(path).extension() != ".mp4")
    throw BadInput("{}: not a video that can be written; allowed: .mp4", path);
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error))
    throw BadInput("{}: there is no folder {}", path, folder.string());
  if (fs::is_directory(path, error)) throw BadInput("{}: is a folder", path);
  if (!std::ofstream(written_.name(), std::ios::binary))
    throw BadInput("{}: cannot be written", path);
  fs::remove(written_.name(), error);
}

VideoFile::~VideoFile() {
  try {
    Finish();
  } catch (const std::exception&) {
  }
}

void VideoFile::Open() {
  const QuietOpenCv quiet;
  const cv::Size size = WithEvenSides(first_.front()).size();
  const int backend =
      cv::videoio_registry::hasBackend(cv::CAP_FFMPEG) ? cv::CAP_FFMPEG : cv::CAP_ANY;
  auto writer = std::make_unique<cv::VideoWriter>();
  for (const char* code : {"avc1", "mp4v"}) {
    const int fourcc = cv::VideoWriter::fourcc(code[0], code[1], code[2], code[3]);
    if (!writer->open(written_.name(), backend, fourcc, FrameRateOf(timestamps_), size)) continue;
    writer_ = std::move(writer);
    for (const cv::Mat& picture : std::exchange(first_, {})) Write(picture);
    return;
  }
  throw BadInput("{}: cannot be written: OpenCV has no encoder for it", path_);
}

void VideoFile::Write(const cv::Mat& picture) {
  writer_->write(WithEvenSides(picture));
  ++count_;
}

void VideoFile::Add(const cv::Mat& picture, double timestamp) {
  OASLAM_CHECK(!finished_ && picture.type() == CV_8UC3);
  if (writer_) return Write(picture);
  first_.push_back(picture.clone());
  timestamps_.push_back(timestamp);
  if (first_.size() == kFirst) Open();
}

void VideoFile::Finish() {
  if (std::exchange(finished_, true)) return;
  if (!writer_ && !first_.empty()) Open();
  if (!writer_) return;
  writer_->release();
  writer_.reset();
  // Encoders do not report a full disk.
  if (FramesIn(written_.name()) != count_ || written_.Rename())
    throw BadInput("{}: could not be written whole", path_);
}

}  // namespace oaslam
