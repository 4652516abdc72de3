#pragma once

#include <deque>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "oaslam/error.h"
#include "oaslam/image_source.h"

namespace oaslam::apps {

// The images of a source that can be processed: readable, of one size, each later than the one
// before. The others are passed over, each with a warning, and counted in one at the end.
class ReadableImages {
 public:
  struct Options {
    bool any_size = false;  // images may differ in size
    bool is_live = false;   // an image must not wait for those after it
    bool says = true;
  };
  // Reads the first images, up to three, since the first may be the odd one; `size` is empty
  // afterwards where there is none.
  ReadableImages(std::unique_ptr<ImageSource> images, const Options& options);

  std::optional<InputImage> Next();
  cv::Size size() const { return size_; }
  // Where none can be read: says so, with what is wrong with the first.
  InputError NoneReadable(const std::string& source) const;
  int count() const { return images_->size(); }  // ImageSource::size

 private:
  std::optional<InputImage> Read();
  void Skip(const InputImage& image, const std::string& why);

  std::unique_ptr<ImageSource> images_;
  Options options_;
  std::deque<InputImage> first_;
  cv::Size size_;
  std::optional<double> last_timestamp_;
  int read_ = 0, skipped_ = 0;
  std::string first_skipped_;  // with the reason
};

}  // namespace oaslam::apps
