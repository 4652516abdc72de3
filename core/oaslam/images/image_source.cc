#include "oaslam/image_source.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "oaslam/fork.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/dataset.h"
#include "oaslam/images/followed_folder.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/images/recorded_images.h"
#include "oaslam/images/video_source.h"
#include "oaslam/recordings/recording_reader.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// One past the last image of the range in the options.
int EndOf(const std::vector<ListedImage>& images, const ImageSourceOptions& options) {
  const int count = static_cast<int>(images.size());
  return options.to < 0 ? count : std::min(options.to, count);
}

// A source that decodes on threads of its own, from a file whose position a forked child would
// share.
class DecodedSource : public ImageSource {
 public:
  explicit DecodedSource(std::unique_ptr<ImageSource> source) : source_(std::move(source)) {}
  std::optional<InputImage> Next() override { return source_->Next(); }
  int size() const override { return source_->size(); }
  void Stop() override {
    if (source_.IsHere()) source_->Stop();
  }

 private:
  ProcessBound<ImageSource> source_;
};

class ListSource : public ImageSource {
 public:
  // `images`: all of the source.
  ListSource(const std::string& source, std::vector<ListedImage> images,
             const ImageSourceOptions& options)
      : source_(source),
        images_(std::move(images)),
        options_(options),
        end_(EndOf(images_, options)),
        next_(options.from) {}

  std::optional<InputImage> Next() override {
    if (next_ >= end_) return std::nullopt;
    if (bits_ == 0) LookAtAll();
    const ListedImage& listed = images_[static_cast<size_t>(next_)];
    const cv::Mat image = ReadImage(listed.path, options_.color, options_.orientation, bits_);
    return InputImage{next_++, listed.timestamp, BaseName(listed.path),
                      image,   listed.path,      options_.orientation};
  }
  int size() const override { return end_ - options_.from; }

 private:
  // All, so that each part of a recording is read alike.
  void LookAtAll() {
    std::vector<std::string> paths;
    for (const ListedImage& image : images_) paths.push_back(image.path);
    bits_ = LookAtImages(source_, paths, options_.quiet);
  }

  std::string source_;
  std::vector<ListedImage> images_;
  ImageSourceOptions options_;
  int end_, next_;
  int bits_ = 0;  // that images of 16 use; 0: not looked at yet
};

void CheckOptions(const ImageSourceOptions& options) {
  if (options.from < 0) throw BadInput("--from {}: allowed: 0 and above", options.from);
  if (options.to >= 0 && options.to <= options.from)
    throw BadInput("--to {}: allowed: above --from {}", options.to, options.from);
  if (options.follow && !(options.follow->quiet_s >= 0 && options.follow->quiet_s <= 1e6))
    throw BadInput("--follow {}: allowed: 0 to 1e6 seconds", options.follow->quiet_s);
  if (options.fps && !(*options.fps > 0 && *options.fps <= 10000))
    throw BadInput("--fps {}: allowed: above 0 to 10000", *options.fps);
}

// A recording in a folder, the first by name; empty: there is none.
std::string RecordingIn(const std::string& folder) {
  std::string first;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string path = entry.path().string();
    if ((first.empty() || path < first) && IsRecording(path)) first = path;
  }
  return first;
}

// All images of a source that is no video and no camera, of which the range has some.
std::optional<std::vector<ListedImage>> ListChecked(const std::string& source,
                                                    const ImageSourceOptions& options) {
  CheckOptions(options);
  if (IsCamera(source)) return std::nullopt;
  auto images = ListAll(source, options);
  if (!images) return std::nullopt;
  if (images->empty()) {
    std::error_code error;
    std::string below;
    if (fs::is_directory(source, error)) below = FolderOfImagesBelow(source);
    if (below.empty()) below = RecordingIn(source);
    throw BadInput("{}: no images{}", source, below.empty() ? "" : "; there are some in " + below);
  }
  if (options.from >= static_cast<int>(images->size()))
    throw BadInput("--from {}: {} has {} images", options.from, source, images->size());
  return images;
}

}  // namespace

std::optional<std::vector<ListedImage>> ListImages(const std::string& source,
                                                   const ImageSourceOptions& options) {
  auto images = ListChecked(source, options);
  if (!images) return std::nullopt;
  images->erase(images->begin() + EndOf(*images, options), images->end());
  images->erase(images->begin(), images->begin() + options.from);
  return images;
}

std::unique_ptr<ImageSource> OpenImages(const std::string& source,
                                        const ImageSourceOptions& options) {
  CheckOptions(options);
  if ((options.follow || IsCamera(source)) && !options.dataset.empty() &&
      Lower(options.dataset) != "none")
    throw BadInput("--dataset {}: not with --follow or a camera", options.dataset);
  std::error_code error;
  if (options.follow && (IsCamera(source) || !fs::is_directory(source, error) ||
                         fs::exists(fs::path(source) / "rgb.txt", error)))
    throw BadInput("{}: --follow asks for a folder of images (without rgb.txt)", source);
  if (IsCamera(source)) return std::make_unique<DecodedSource>(OpenStream(source, options));
  if (IsRecording(source))
    return std::make_unique<DecodedSource>(OpenRecordedImages(source, options));
  if (!options.topic.empty())
    throw BadInput("{}: --topic {}: is no recording of ROS", source, options.topic);
  if (options.follow) return FollowFolder(source, options);
  if (auto images = ListChecked(source, options))
    return std::make_unique<ListSource>(source, std::move(*images), options);
  if (options.time_unit)
    throw BadInput("{}: --time-unit: a video tells the unit of its times", source);
  return std::make_unique<DecodedSource>(OpenVideo(FilmOf(source, options), options));
}

}  // namespace oaslam
