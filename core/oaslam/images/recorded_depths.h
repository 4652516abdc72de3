#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/image_source.h"
#include "oaslam/recordings/recording_reader.h"

namespace oaslam {

// The depths of a topic in a recording of ROS, which are read as the time of the images goes on.
class RecordedDepths {
 public:
  // Throws InputError where the recording cannot be opened.
  RecordedDepths(const std::string& path, const std::string& topic);
  // The depth image nearest to a time, in counts or metres; empty where none is within 0.02 s. The
  // times of the calls ascend. Throws InputError where the recording is damaged.
  cv::Mat Near(double time);
  // Whether there is one for any of these images.
  bool HasAny(const std::vector<ListedImage>& images) const;

 private:
  struct Timed {
    double time = 0;
    cv::Mat image;
  };
  std::optional<Timed> Read();

  std::string path_, topic_;
  std::unique_ptr<RecordingReader> reader_;
  std::optional<Timed> before_, next_;  // around the time of the last call
};

}  // namespace oaslam
