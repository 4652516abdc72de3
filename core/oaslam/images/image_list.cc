#include "oaslam/images/image_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <utility>

#include "oaslam/formats/text.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/formats/unicode.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/dataset.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/image_kinds.h"
#include "oaslam/images/list_clock.h"
#include "oaslam/images/recorded_images.h"
#include "oaslam/images/sensor_data.h"
#include "oaslam/images/video_container.h"
#include "oaslam/images/video_source.h"
#include "oaslam/recordings/recording_reader.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

struct ListLine {
  std::optional<double> time;
  std::string_view path;  // empty: the line is not understood
};

// "path", or "path timestamp" and "path,timestamp".
ListLine ParsePathFirst(std::string_view line) {
  const size_t blank = line.find_last_of(" \t,");
  if (blank == std::string_view::npos) return {std::nullopt, line};
  const std::optional<double> time = ParseNumber(line.substr(blank + 1));
  std::string_view path = Trim(line.substr(0, blank));
  if (path.ends_with(',')) path.remove_suffix(1);
  if (!time || !HasImageExtension(std::string(path))) return {std::nullopt, line};
  return {time, path};
}

// "timestamp path", "timestamp,path", "path" or "path timestamp". Of an association (of TUM's
// tools) "timestamp path timestamp path" the image that is no depth image.
ListLine ParseLine(std::string_view line) {
  const std::string_view first = line.substr(0, line.find_first_of(" \t,"));
  const std::optional<double> time = ParseNumber(first);
  if (!time) return ParsePathFirst(line);
  std::string_view rest = Trim(line.substr(first.size()));
  if (rest.starts_with(',')) rest = Trim(rest.substr(1));
  const auto fields = SplitFields(rest);
  const auto is_image = [&](size_t i) { return HasImageExtension(std::string(fields[i])); };
  if (fields.size() < 3 || !is_image(0) || !is_image(2)) return {time, rest};
  const std::optional<double> second = ParseNumber(fields[1]);
  if (!second) return {time, rest};
  const bool is_second = fields[0].find("depth") != std::string_view::npos;
  return is_second ? ListLine{second, fields[2]} : ListLine{time, fields[0]};
}

// Whether a first line names columns.
bool IsHeader(const ListLine& line) {
  const std::string lower = Lower(line.path);
  return !line.time && !HasImageExtension(lower) && lower.find(',') != std::string::npos &&
         lower.find("time") != std::string::npos;
}

// The folder to which the paths of a list refer.
fs::path FolderOfList(const std::string& path) {
  // Standard input that is a file is one of the links there.
  std::error_code error;
  const fs::path real = path.starts_with("/dev/") ? fs::canonical(path, error) : fs::path(path);
  return (error ? fs::path(path) : real).parent_path();
}

// EuRoC's lists name images in the folder `data` beside them.
std::string PathOfLine(const fs::path& folder, std::string_view path) {
  std::error_code error;
  const fs::path beside = folder / path, in_data = folder / "data" / path;
  if (!fs::exists(beside, error) && fs::exists(in_data, error)) return in_data.string();
  return FileInEitherForm(beside.string());
}

void CheckSteps(const std::vector<ListedImage>& images, const std::string& source) {
  std::vector<double> times;
  for (const ListedImage& image : images) times.push_back(image.timestamp);
  if (const std::string problem = ProblemOfSteps(times); !problem.empty())
    throw BadInput("{}: {}", source, problem);
}

// A folder of nothing but what a sensor measured.
void RefuseRawFiles(const std::string& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const std::string path = entry.path().string(); HasRawExtension(path))
      throw InputError(RefusalOfSensorData(path));
}

// Whether a file may be a list: it has no control characters, and no line that is longer than a
// path.
bool IsText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 1 << 16> head{};  // enough to tell text from binary data
  file.read(head.data(), head.size());
  return LooksLikeText({head.data(), static_cast<size_t>(file.gcount())});
}

// "DIR/%06d.png" and "DIR/*.png" are how other programs name the images of a folder.
std::string HintForPattern(const std::string& source) {
  const fs::path path(source), folder = path.parent_path();
  std::error_code error;
  if (path.filename().string().find_first_of("%*?") == std::string::npos ||
      !fs::is_directory(folder, error))
    return "";
  return fmt::format("; for the images in a folder give the folder: {}", folder.string());
}

// Recordings of other tools that contain images in a form of their own, and how to get at them.
void RefuseRecording(const std::string& source) {
  struct Recording {
    const char *extension, *what;
  };
  static constexpr Recording kRecordings[] = {
      {".r3d", "a recording of Record3D, which is a zip archive: unzip FILE -d DIR, and give DIR"},
      {".zip", "an archive: unzip FILE -d DIR, and give DIR"},
      {".svo", "a recording of a ZED camera: export its left images (svo_export of the ZED SDK)"},
      {".svo2", "a recording of a ZED camera: export its left images (svo_export of the ZED SDK)"},
      {".vrs", "a VRS recording: vrs extract-images FILE --to DIR, and give DIR"},
      {".bag", "no recording of ROS 1 that is read: it does not begin with #ROSBAG V2.0"},
      {".db3", "no recording of ROS 2: it is no SQLite database"},
      {".mcap", "no recording of ROS: it does not begin as an MCAP file"}};
  const auto found = std::ranges::find(kRecordings, LowerExtension(source), &Recording::extension);
  if (found != std::end(kRecordings)) throw BadInput("{}: is {}", source, found->what);
}

void CheckPlainFile(const std::string& source) {
  std::error_code error;
  switch (fs::status(source, error).type()) {
    case fs::file_type::regular:
      if (fs::file_size(source, error) == 0) throw BadInput("{}: is empty", source);
      return;
    case fs::file_type::fifo:
    case fs::file_type::socket:
      throw BadInput("{}: is a pipe, which can be read only once; save it as a file", source);
    default:
      throw BadInput("{}: is a device, expected a file or a folder; webcam:N is a camera", source);
  }
}

}  // namespace

bool SetTimes(const std::string& source, const ImageSourceOptions& options,
              std::vector<ListedImage>& images) {
  std::vector<std::string> names;
  for (const ListedImage& image : images) names.push_back(image.path);
  const auto times = TimesOfNames(names, options.time_unit);
  if (options.time_unit && !times)
    throw BadInput("{}: --time-unit: the names of the images are no times", source);
  for (size_t i = 0; times && i < images.size(); ++i) images[i].timestamp = times->seconds[i];
  if (times) {
    std::ranges::stable_sort(images, {}, &ListedImage::timestamp);
    if (!options.time_unit && !options.fps) CheckSteps(images, source);
    if (!options.fps && !options.quiet)
      Log(LogLevel::kInfo, "{}: the names of the images are taken as times, in {}", source,
          NameOfUnit(times->unit));
    if (!options.fps) return true;
  }
  for (size_t i = 0; i < images.size(); ++i)
    images[i].timestamp = static_cast<double>(i) / options.fps.value_or(kDefaultFps);
  return false;
}

std::vector<ListedImage> ListFolder(const std::string& folder, const ImageSourceOptions& options,
                                    const std::string& end) {
  std::vector<std::string> names = ImageNames(folder);
  std::erase_if(names,
                [&](const std::string& name) { return !WithoutExtension(name).ends_with(end); });
  LeaveOutOtherKinds(folder, options.quiet, names);
  if (!options.quiet) WarnOfSeries(folder, names);
  std::vector<ListedImage> images;
  for (const std::string& name : names) images.push_back({0, (fs::path(folder) / name).string()});
  if (images.empty()) RefuseRawFiles(folder);
  SetTimes(folder, options, images);
  return images;
}

std::vector<ListedImage> ReadList(const std::string& path, const ImageSourceOptions& options) {
  const fs::path folder = FolderOfList(path);
  const std::string text = ReadTextFile(path);
  std::vector<ListedImage> images;
  std::vector<int> lines;
  std::optional<bool> with_times;
  std::optional<double> unit = options.time_unit;
  int line_number = 0;
  for (const std::string_view raw : SplitLines(text)) {
    ++line_number;
    const std::string_view line = Trim(raw);
    if (!with_times && line.find("[ns]") != std::string_view::npos && !unit) unit = 1e-9;
    if (line.empty() || line[0] == '#') continue;
    const ListLine parsed = ParseLine(line);
    if (!with_times && IsHeader(parsed)) continue;
    if (parsed.path.empty() || (with_times && *with_times != parsed.time.has_value()))
      throw BadInput("{}:{}: {}, expected \"{}path\"", path, line_number, Quoted(line),
                     with_times.value_or(true) ? "timestamp " : "");
    with_times = parsed.time.has_value();
    if (IsHelperFile(BaseName(std::string(parsed.path)))) continue;
    if (HasRawExtension(std::string(parsed.path)))
      throw InputError(RefusalOfSensorData(PathOfLine(folder, parsed.path)));
    images.push_back({parsed.time.value_or(0) * unit.value_or(1), PathOfLine(folder, parsed.path)});
    lines.push_back(line_number);
  }
  if (!with_times.value_or(true))
    SetTimes(path, options, images);
  else if (!unit)
    CheckSteps(images, path);
  if (with_times.value_or(false)) ContinueTimes(path, lines, options.quiet, images);
  return images;
}

std::optional<std::vector<ListedImage>> ListAll(const std::string& source,
                                                const ImageSourceOptions& options) {
  std::error_code error;
  if (!fs::exists(source, error)) {
    if (error == std::errc::too_many_symbolic_link_levels)
      throw BadInput("{}: is a link that leads back to itself", source);
    if (fs::is_symlink(source, error))
      throw BadInput("{}: is a link to {}, which is not there", source,
                     fs::read_symlink(source, error).string());
    throw BadInput("{}: there is no such file or folder{}", source, HintForPattern(source));
  }
  if (IsRecording(source)) return std::nullopt;
  if (auto dataset = FindDataset(source, options)) {
    if (!dataset->film.empty()) return std::nullopt;
    return std::move(dataset->images);
  }
  if (fs::is_directory(source, error)) return ListFolder(source, options);
  CheckPlainFile(source);
  RefuseRecording(source);
  if (HasRawExtension(source)) throw InputError(RefusalOfSensorData(source));
  if (HasImageExtension(source)) return std::vector{ListedImage{0.0, source}};
  if (IsText(source)) return ReadList(source, options);
  return std::nullopt;
}

std::vector<ListedImage> TimesOfImages(const std::string& source,
                                       const ImageSourceOptions& options) {
  if (options.follow || IsCamera(source)) return {};
  ImageSourceOptions quiet = options;
  quiet.quiet = true;
  if (auto images = ListAll(source, quiet)) return std::move(*images);
  if (IsRecording(source)) return TimesOfRecordedImages(source, options);
  const FilmSource film = FilmOf(source, options);
  const VideoContainer video = ReadVideoContainer(film.path);
  const bool is_listed = film.times.size() == static_cast<size_t>(video.images);
  const std::vector<double>& times = is_listed ? film.times : video.times.seconds;
  std::vector<ListedImage> images;
  for (int i = 0; i < video.images && (options.fps || !times.empty()); ++i)
    images.push_back(
        {options.fps ? i / *options.fps : times.at(static_cast<size_t>(i)), NameOfVideoImage(i)});
  return images;
}

std::vector<std::string> NamesOfImages(const std::string& source,
                                       const ImageSourceOptions& options) {
  std::vector<std::string> names;
  if (options.follow || IsCamera(source)) return names;
  ImageSourceOptions quiet = options;
  quiet.quiet = true;
  if (const auto images = ListAll(source, quiet)) {
    for (const ListedImage& image : *images) names.push_back(image.path);
    return names;
  }
  if (IsRecording(source)) {
    for (const ListedImage& image : TimesOfRecordedImages(source, options))
      names.push_back(image.path);
    return names;
  }
  const int count = ReadVideoContainer(FilmOf(source, options).path).images;
  for (int i = 0; i < count; ++i) names.push_back(NameOfVideoImage(i));
  return names;
}

}  // namespace oaslam
