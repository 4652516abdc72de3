#include "oaslam/images/depth_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

#include "oaslam/camera_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/image_files.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/trim.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr double kTumUnit = 1.0 / 5000;

// A line "time path", or an association of two such pairs, in either order.
DepthFile ParseLine(const fs::path& folder, std::string_view line, const std::string& place) {
  const auto fields = SplitFields(line);
  const bool is_pair = fields.size() == 2, is_association = fields.size() == 4;
  if ((!is_pair && !is_association) || !ParseNumber(fields[0]) ||
      (is_association && !ParseNumber(fields[2])))
    throw BadInput("{}: {}, expected \"time depth\" or \"time image time depth\"", place,
                   Quoted(line));
  const bool is_first =
      is_pair || fields[1].substr(0, fields[1].rfind('.')).find("depth") != std::string_view::npos;
  DepthFile file{(folder / (is_first ? fields[1] : fields[3])).string()};
  if (is_association)
    file.image = BaseName(std::string(is_first ? fields[3] : fields[1]));
  else
    file.time = ParseNumber(fields[0]);
  return file;
}

// The last number in a name, such as 12 in "frame-000012.depth.png".
std::optional<long> LastNumber(const std::string& path) {
  const std::string name = WithoutExtension(BaseName(path));
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto end = std::find_if(name.rbegin(), name.rend(), is_digit).base();
  auto begin = end;
  while (begin != name.begin() && is_digit(*(begin - 1))) --begin;
  constexpr int kMostDigits = 18;
  if (begin == end || end - begin > kMostDigits) return std::nullopt;
  return std::stol(std::string(begin, end));
}

using FileOf = std::map<std::string, size_t>;

FileOf MatchNames(const std::vector<DepthFile>& files, const std::vector<ListedImage>& images) {
  std::map<std::string, size_t> by_name;
  for (size_t i = 0; i < files.size(); ++i)
    if (!files[i].image.empty()) by_name.emplace(files[i].image, i);
  FileOf found;
  for (const ListedImage& image : images)
    if (const auto file = by_name.find(BaseName(image.path)); file != by_name.end())
      found.emplace(image.path, file->second);
  return found;
}

FileOf MatchTimes(const std::vector<DepthFile>& files, const std::vector<ListedImage>& images) {
  constexpr double kMostApart = 0.02;  // s, as TUM's tools
  std::vector<std::pair<double, size_t>> times;
  for (size_t i = 0; i < files.size(); ++i)
    if (files[i].time) times.emplace_back(*files[i].time, i);
  std::ranges::sort(times);
  FileOf found;
  for (const ListedImage& image : images) {
    auto next = std::ranges::lower_bound(times, std::pair(image.timestamp, size_t{0}));
    if (next == times.end() || (next != times.begin() && image.timestamp - (next - 1)->first <
                                                             next->first - image.timestamp)) {
      if (next == times.begin()) break;  // there are none
      --next;
    }
    if (std::abs(next->first - image.timestamp) <= kMostApart)
      found.emplace(image.path, next->second);
  }
  return found;
}

// None where two files have the same number, or an image has none.
FileOf MatchNumbers(const std::vector<DepthFile>& files, const std::vector<ListedImage>& images) {
  std::map<long, size_t> by_number;
  for (size_t i = 0; i < files.size(); ++i) {
    const auto number = LastNumber(files[i].path);
    if (!number || !by_number.emplace(*number, i).second) return {};
  }
  FileOf found;
  for (const ListedImage& image : images) {
    const auto number = LastNumber(image.path);
    if (!number) return {};
    if (const auto file = by_number.find(*number); file != by_number.end())
      found.emplace(image.path, file->second);
  }
  return found;
}

FileOf MatchOrder(const std::vector<DepthFile>& files, const std::vector<ListedImage>& images) {
  FileOf found;
  if (files.size() == images.size())
    for (size_t i = 0; i < files.size(); ++i) found.emplace(images[i].path, i);
  return found;
}

}  // namespace

DepthFiles LoadDepthFiles(const std::string& path) {
  constexpr double kMillimetre = 1e-3;
  std::error_code error;
  if (fs::is_directory(path, error)) return LoadDepthFiles(path, kMillimetre);
  DepthFiles found{path, {}, kTumUnit};
  const std::string text = ReadTextFile(path);
  int number = 0;
  for (const std::string_view raw : SplitLines(text)) {
    ++number;
    const std::string_view line = Trim(raw);
    if (line.empty() || line[0] == '#') continue;
    found.files.push_back(
        ParseLine(fs::path(path).parent_path(), line, fmt::format("{}:{}", path, number)));
  }
  if (found.files.empty()) throw BadInput("{}: no depth images in it", path);
  return found;
}

DepthFiles LoadDepthFiles(const std::string& folder, double unit) {
  DepthFiles found{folder, {}, unit};
  std::vector<std::string> names = ImageNames(folder);
  // A folder of colours and depths side by side, as that of 7-Scenes.
  const auto is_depth = [](const std::string& name) {
    return name.find("depth") != std::string::npos;
  };
  if (std::ranges::any_of(names, is_depth))
    std::erase_if(names, [&](const std::string& name) { return !is_depth(name); });
  for (const std::string& name : names) found.files.push_back({(fs::path(folder) / name).string()});
  if (names.empty()) throw BadInput("{}: no depth images in it", folder);
  if (const auto times = TimesOfNames(names))
    for (size_t i = 0; i < names.size(); ++i) found.files[i].time = times->seconds[i];
  return found;
}

void SetDepthCamera(const std::string& path, DepthFiles& files) {
  const cv::Size size =
      files.topic.empty() ? ReadUnchanged(files.files.front().path).size() : cv::Size();
  files.camera = LoadCamera(path, size);
  if (path.starts_with("fov:")) return;
  const std::string text = ReadTextFile(path);
  if (text.find("T_cam_depth") == std::string::npos) return;
  if (const YAML::Node motion = ParseYamlMapping(text, path)["T_cam_depth"])
    files.cam_from_depth = YamlMotion(motion, path, "T_cam_depth");
}

DepthSource::DepthSource(DepthFiles files, const std::vector<ListedImage>& images)
    : files_(std::move(files)) {
  if (!files_.topic.empty()) {
    for (const ListedImage& image : images) times_.emplace(image.path, image.timestamp);
    recorded_ = std::make_unique<RecordedDepths>(files_.path, files_.topic);
    if (!recorded_->HasAny(images))
      throw BadInput(
          "{}: {}: none of its depths belongs to one of the {} images, by times (0.02 s); --depth "
          "none leaves them out",
          files_.path, files_.topic, images.size());
    return;
  }
  for (const auto match : {MatchNames, MatchTimes, MatchNumbers, MatchOrder})
    if (file_of_.empty()) file_of_ = match(files_.files, images);
  if (file_of_.empty())
    throw BadInput(
        "{}: none of its {} depths belongs to one of the {} images, by times (0.02 s), numbers in "
        "the names, or count; the first is {}",
        files_.path, files_.files.size(), images.size(), Quoted(files_.files.front().path));
  const std::string& first = files_.files[file_of_.begin()->second].path;
  const cv::Mat image = ReadUnchanged(first);
  if (image.empty()) throw BadInput("{}: cannot be read as a depth image", first);
  if (image.type() != CV_16UC1 && image.type() != CV_32FC1)
    throw BadInput("{}: {} bits and {} channels, expected a depth image: one channel of 16 bits",
                   first, 8 * image.elemSize1(), image.channels());
}

std::optional<DepthImage> DepthSource::Described(cv::Mat image) const {
  DepthImage depth;
  depth.image = std::move(image);
  depth.unit = files_.unit;
  depth.camera = files_.camera;
  depth.cam_from_depth = files_.cam_from_depth;
  const bool fits_camera = !files_.camera || (depth.image.cols == files_.camera->width &&
                                              depth.image.rows == files_.camera->height);
  const bool is_depth = depth.image.type() == CV_16UC1 || depth.image.type() == CV_32FC1;
  return is_depth && fits_camera ? std::optional(depth) : std::nullopt;
}

std::optional<DepthImage> DepthSource::FindRecorded(const std::string& image) {
  const auto time = times_.find(image);
  cv::Mat found = time == times_.end() ? cv::Mat() : recorded_->Near(time->second);
  if (found.empty()) return std::nullopt;
  std::optional<DepthImage> depth = Described(std::move(found));
  if (!depth && !std::exchange(has_warned_, true))
    Log(LogLevel::kWarning,
        "{}: {}: a depth of another size or type than the first one or its CameraInfo, left out, "
        "as are others alike",
        files_.path, files_.topic);
  return depth;
}

std::optional<DepthImage> DepthSource::Find(const std::string& image) {
  if (recorded_) return FindRecorded(image);
  const auto found = file_of_.find(image);
  if (found == file_of_.end()) return std::nullopt;
  const std::string& path = files_.files[found->second].path;
  std::optional<DepthImage> depth = Described(ReadUnchanged(path));
  if (!depth) {
    if (!std::exchange(has_warned_, true))
      Log(LogLevel::kWarning, "{}: no depth image as the first one, left out, as are others alike",
          path);
    return std::nullopt;
  }
  if (files_.confidence.empty()) return depth;
  const cv::Mat trust = ReadUnchanged((fs::path(files_.confidence) / BaseName(path)).string());
  if (trust.type() == CV_8UC1 && trust.size() == depth->image.size())
    depth->image.setTo(0, trust == 0);
  return depth;
}

}  // namespace oaslam
