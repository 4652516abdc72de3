#include "oaslam/image_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <vector>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/followed_folder.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/video_source.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr double kDefaultFps = 30;  // of most cameras

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

std::vector<ListedImage> ListFolder(const std::string& folder, double fps) {
  std::vector<ListedImage> images;
  for (const std::string& name : ImageNames(folder))
    images.push_back(
        {static_cast<double>(images.size()) / fps, (fs::path(folder) / name).string()});
  return images;
}

// "timestamp path" or "path" in each line, all lines alike; paths are relative to
// the folder of the list.
std::vector<ListedImage> ReadList(const std::string& path, double fps) {
  const fs::path folder = fs::path(path).parent_path();
  const std::string text = ReadTextFile(path);
  std::vector<ListedImage> images;
  std::optional<bool> with_times;
  int line_number = 0;
  for (const std::string_view raw : SplitLines(text)) {
    ++line_number;
    const std::string_view line = Trim(raw);
    if (line.empty() || line[0] == '#') continue;
    const std::string_view first = SplitFields(line)[0];
    const auto timestamp = ParseNumber(first);
    const std::string_view rest = timestamp ? Trim(line.substr(first.size())) : line;
    if (rest.empty() || (with_times && *with_times != timestamp.has_value()))
      throw InputError(fmt::format("{}:{}: \"{}\", expected \"{}path\"", path, line_number, line,
                                   with_times.value_or(true) ? "timestamp " : ""));
    with_times = timestamp.has_value();
    images.push_back(
        {timestamp.value_or(static_cast<double>(images.size()) / fps), (folder / rest).string()});
  }
  return images;
}

bool IsText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 4096> head{};  // enough to tell text from binary data
  file.read(head.data(), head.size());
  return std::find(head.begin(), head.begin() + file.gcount(), '\0') ==
         head.begin() + file.gcount();
}

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

// All images of a source; nothing where it is a video or a camera.
std::optional<std::vector<ListedImage>> ListAll(const std::string& source, double fps) {
  std::error_code error;
  if (!fs::exists(source, error))
    throw InputError(fmt::format("{}: there is no such file or folder", source));
  if (fs::is_directory(source, error)) {
    const std::string list = (fs::path(source) / "rgb.txt").string();
    return fs::exists(list, error) ? ReadList(list, fps) : ListFolder(source, fps);
  }
  if (fs::is_regular_file(source, error) && fs::file_size(source, error) == 0)
    throw InputError(fmt::format("{}: is empty", source));
  if (HasImageExtension(source)) return std::vector{ListedImage{0.0, source}};
  if (IsText(source)) return ReadList(source, fps);
  return std::nullopt;
}

}  // namespace

std::optional<std::vector<ListedImage>> ListImages(const std::string& source,
                                                   const ImageSourceOptions& options) {
  CheckOptions(options);
  if (IsCamera(source)) return std::nullopt;
  auto images = ListAll(source, options.fps.value_or(kDefaultFps));
  if (!images) return std::nullopt;
  const int count = static_cast<int>(images->size());
  if (count == 0) throw InputError(fmt::format("{}: no images", source));
  if (options.from >= count)
    throw InputError(fmt::format("--from {}: {} has {} images", options.from, source, count));
  images->resize(static_cast<size_t>(options.to < 0 ? count : std::min(options.to, count)));
  images->erase(images->begin(), images->begin() + options.from);
  return images;
}

std::unique_ptr<ImageSource> OpenImages(const std::string& source,
                                        const ImageSourceOptions& options) {
  CheckOptions(options);
  if (options.follow &&
      (IsCamera(source) || !fs::is_directory(source) || fs::exists(fs::path(source) / "rgb.txt")))
    throw InputError(
        fmt::format("{}: --follow asks for a folder of images (without rgb.txt)", source));
  if (IsCamera(source)) return OpenCamera(source, options);
  if (options.follow) return FollowFolder(source, options, options.fps.value_or(kDefaultFps));
  if (auto images = ListImages(source, options))
    return std::make_unique<ListSource>(std::move(*images), options);
  return OpenVideo(source, options);
}

}  // namespace oaslam
