#include "oaslam/images/video_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>
#include <optional>
#include <vector>

#include "oaslam/images/image_files.h"
#include "oaslam/images/video_container.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// FFmpeg if possible, since backends disagree on the images of a file.
int Backend() {
  return cv::videoio_registry::hasBackend(cv::CAP_FFMPEG) ? cv::CAP_FFMPEG : cv::CAP_ANY;
}

// The image with square pixels: its width is stretched, as players do.
cv::Mat WithSquarePixels(const cv::Mat& image, double pixel_ratio) {
  const int width = static_cast<int>(std::lround(image.cols * pixel_ratio));
  if (width == image.cols || width < 1) return image;
  cv::Mat square;
  cv::resize(image, square, {width, image.rows}, 0, 0,
             width > image.cols ? cv::INTER_LINEAR : cv::INTER_AREA);
  return square;
}

class VideoSource : public ImageSource {
 public:
  VideoSource(const FilmSource& film, const ImageSourceOptions& options)
      : path_(film.path), options_(options), container_(ReadVideoContainer(film.path)) {
    const std::string& path = path_;
    const int images = container_.images;
    if (images == 0) throw BadInput("{}: no image in it, damaged?", path);
    if (options.from >= images)
      throw BadInput("--from {}: {} has {} frames", options.from, path, images);
    // Of a relative path, a colon may end the name of a protocol.
    if (!capture_.open(std::filesystem::absolute(path).string(), Backend()))
      throw BadInput("{}: cannot be decoded ({})", path, container_.codec);
    // Rotation is done here, by the container's value: OpenCV 4.6 rotates by 90 degrees in the
    // wrong direction.
    capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
    const double rate = capture_.get(cv::CAP_PROP_FPS);
    // Damaged headers have rates beyond these.
    if (std::isfinite(rate) && rate > 0.1 && rate < 10000) rate_ = rate;
    if (options.fps) rate_ = *options.fps;
    if (film.times.size() == static_cast<size_t>(images))
      listed_times_ = film.times;
    else if (!film.times.empty() && !options.quiet)
      Log(LogLevel::kWarning,
          "{}: has {} images, but {} times are listed for them: its own times are taken", path,
          images, film.times.size());
    if (!options.quiet) Warn();
  }

  std::optional<InputImage> Next() override {
    for (; options_.to < 0 || index_ < options_.to; ++index_) {
      if (!Grab()) return End();
      const double timestamp = Timestamp();
      if (index_ < options_.from) continue;
      const bool keeps_color = options_.color || options_.color_if_free;
      cv::Mat image;
      if (!capture_.retrieve(keeps_color ? image : decoded_)) return End();
      if (!keeps_color && decoded_.channels() == 3)
        cv::cvtColor(decoded_, image, cv::COLOR_BGR2GRAY);
      else if (!keeps_color)
        decoded_.copyTo(image);
      image = Turned(WithSquarePixels(image, container_.pixel_ratio), container_.turn_deg / 90);
      // cv::VideoCapture may overwrite its image.
      if (container_.turn_deg == 0) image = image.clone();
      const int index = index_++;
      return InputImage{index, timestamp, NameOfVideoImage(index), image};
    }
    return std::nullopt;
  }
  int size() const override {
    return (options_.to < 0 ? container_.images : std::min(options_.to, container_.images)) -
           options_.from;
  }

 private:
  void Warn() const {
    const auto warn = [this](const std::string& what) {
      Log(LogLevel::kWarning, path_ + ": " + what);
    };
    const int images = container_.images, announced = container_.announced;
    if (images < announced && container_.ends_in_time)
      warn(fmt::format("{} of {} images were dropped by the recorder; the others keep their times",
                       announced - images, announced));
    else if (images < announced)
      warn(fmt::format("ends after {} of {} images, damaged?", images, announced));
    if (const double ratio = container_.pixel_ratio; std::abs(ratio - 1) > 1e-3)
      Log(LogLevel::kInfo,
          "{}: its pixels are {:.4g} times as wide as high; images are stretched to square "
          "ones, as players show them, and calibration and boxes are of these",
          path_, ratio);
    if (const double ratio = container_.odd_pixel_ratio; ratio != 1)
      warn(fmt::format("pixels {:.4g} times as wide as high are not believed; taken as square",
                       ratio));
    if (!container_.other_streams.empty())
      warn(fmt::format(
          "has other video streams ({}); the first is taken (ffmpeg -i IN -map 0:v:1 -c "
          "copy OUT: the second alone)",
          container_.other_streams));
    if (options_.fps) return;
    if (container_.times.seconds.empty())
      warn(fmt::format(
          "no time stamps that can be used; taken as {:g} images a second (--fps: another rate)",
          rate_));
    if (const int repaired = container_.times.repaired; repaired > 0)
      warn(fmt::format(
          "{} of {} time stamps are those of the image before; spread up to the next one", repaired,
          images));
  }

  // Skips damaged images, which OpenCV takes for the end.
  bool Grab() {
    while (!capture_.grab())
      if (++failures_ > container_.images - index_) return false;
    return true;
  }

  std::optional<InputImage> End() {
    if (index_ == 0)
      throw BadInput("{}: not one of its images can be decoded ({})", path_, container_.codec);
    const int missing = container_.images - index_;
    if (missing > 0)
      Log(LogLevel::kWarning, "{}: {} of {} images could not be decoded", path_, missing,
          container_.images);
    options_.to = index_;
    return std::nullopt;
  }

  // The time of the image that was grabbed; to be called once for each.
  double Timestamp() {
    const std::vector<double>& times = container_.times.seconds;
    if (options_.fps || (times.empty() && listed_times_.empty())) return index_ / rate_;
    if (times.empty()) return listed_times_.at(static_cast<size_t>(index_));
    const size_t i =
        TimeIndexOf(container_.times, next_time_, capture_.get(cv::CAP_PROP_POS_MSEC) / 1000);
    next_time_ = i + 1;
    if (i < listed_times_.size()) return listed_times_[i];
    // The container may have announced fewer images.
    const double time = i < times.size()
                            ? times[i]
                            : times.back() + static_cast<double>(i + 1 - times.size()) / rate_;
    if (index_ == 0) first_s_ = time;
    return time - first_s_;
  }

  std::string path_;
  std::vector<double> listed_times_;  // of all images; empty: there are none
  ImageSourceOptions options_;
  VideoContainer container_;
  cv::VideoCapture capture_;
  cv::Mat decoded_;   // memory for an image in colour that is given in grey
  double rate_ = 30;  // images a second, where times are not taken from the container
  int index_ = 0;     // of the next image, among those that can be decoded
  int failures_ = 0;
  size_t next_time_ = 0;
  double first_s_ = 0;  // of the first image that could be decoded
};

}  // namespace

std::string NameOfVideoImage(int index) { return fmt::format("{:06}", index); }

std::unique_ptr<ImageSource> OpenVideo(const FilmSource& film, const ImageSourceOptions& options) {
  return std::make_unique<VideoSource>(film, options);
}

}  // namespace oaslam
