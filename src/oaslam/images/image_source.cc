#include "oaslam/image_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/followed_folder.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_list.h"
#include "oaslam/images/video_source.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

class ListSource : public ImageSource {
 public:
  // `images` begin with the image of index `from`.
  ListSource(std::vector<ListedImage> images, const ImageSourceOptions& options)
      : images_(std::move(images)), options_(options) {}

  std::optional<InputImage> Next() override {
    if (next_ >= size()) return std::nullopt;
    const ListedImage& listed = images_[next_];
    const cv::Mat image = ReadImage(listed.path, options_.color, options_.orientation);
    const int index = options_.from + next_++;
    return InputImage{index, listed.timestamp, BaseName(listed.path),
                      image, listed.path,      options_.orientation};
  }
  int size() const override { return static_cast<int>(images_.size()); }

 private:
  std::vector<ListedImage> images_;
  ImageSourceOptions options_;
  int next_ = 0;
};

void CheckOptions(const ImageSourceOptions& options) {
  if (options.from < 0)
    throw InputError(fmt::format("--from {}: allowed: 0 and above", options.from));
  if (options.to >= 0 && options.to <= options.from)
    throw InputError(fmt::format("--to {}: allowed: above --from {}", options.to, options.from));
  if (options.follow && !(options.follow->quiet_s >= 0 && options.follow->quiet_s <= 1e6))
    throw InputError(
        fmt::format("--follow {}: allowed: 0 to 1e6 seconds", options.follow->quiet_s));
  if (options.fps && !(*options.fps > 0 && *options.fps <= 10000))
    throw InputError(fmt::format("--fps {}: allowed: above 0 to 10000", *options.fps));
}

}  // namespace

std::optional<std::vector<ListedImage>> ListImages(const std::string& source,
                                                   const ImageSourceOptions& options) {
  CheckOptions(options);
  if (IsCamera(source)) return std::nullopt;
  auto images = ListAll(source, options);
  if (!images) return std::nullopt;
  const int count = static_cast<int>(images->size());
  if (count == 0) {
    std::error_code error;
    const std::string below =
        fs::is_directory(source, error) ? FolderOfImagesBelow(source) : std::string();
    throw InputError(fmt::format("{}: no images{}", source,
                                 below.empty() ? "" : "; there are some in " + below));
  }
  if (options.from >= count)
    throw InputError(fmt::format("--from {}: {} has {} images", options.from, source, count));
  images->resize(static_cast<size_t>(options.to < 0 ? count : std::min(options.to, count)));
  images->erase(images->begin(), images->begin() + options.from);
  return images;
}

std::unique_ptr<ImageSource> OpenImages(const std::string& source,
                                        const ImageSourceOptions& options) {
  CheckOptions(options);
  std::error_code error;
  if (options.follow && (IsCamera(source) || !fs::is_directory(source, error) ||
                         fs::exists(fs::path(source) / "rgb.txt", error)))
    throw InputError(
        fmt::format("{}: --follow asks for a folder of images (without rgb.txt)", source));
  if (IsCamera(source)) return OpenCamera(source, options);
  if (options.follow) return FollowFolder(source, options);
  if (auto images = ListImages(source, options))
    return std::make_unique<ListSource>(std::move(*images), options);
  if (options.time_unit)
    throw InputError(fmt::format("{}: --time-unit: a video tells the unit of its times", source));
  return OpenVideo(source, options);
}

}  // namespace oaslam
