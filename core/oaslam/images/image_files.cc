#include "oaslam/images/image_files.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/formats/text.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/heif_file.h"
#include "oaslam/images/sensor_data.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// "thumb_0001.jpg", "0001_thumb.jpg", "0001.thumbnail.png", "0001-thumb.jpg"; of a name in lower
// case.
bool IsThumbnail(const std::string& name) {
  const std::string stem = WithoutExtension(name);
  for (const char* word : {"thumb", "thumbnail"})
    for (const char mark : {'_', '-', '.'})
      if (stem.starts_with(std::string(word) + mark) || stem.ends_with(mark + std::string(word)))
        return true;
  return false;
}

// Whether a file begins like an image, or is one that was damaged: it is empty, begins with zeros,
// or cannot be read.
bool MayBeImage(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 12> head{};
  if (!file.read(head.data(), head.size()) && file.gcount() == 0) return true;
  const std::string_view text(head.data(), head.size());
  const bool is_zero = text.find_first_not_of('\0') == std::string_view::npos;
  const bool is_heif = text.substr(4, 4) == "ftyp";  // of HEIC and AVIF, too
  return is_zero || is_heif || cv::haveImageReader(path);
}

}  // namespace

std::vector<char> BytesOf(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return {};
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

cv::Mat ReadImage(const std::string& path, bool color, Orientation orientation, int bits) {
  const std::vector<char> bytes = BytesOf(path);
  if (bytes.empty()) return {};
  if (IsHeif(bytes)) return DecodeHeif(bytes, color, orientation, path);
  if (IsRawTiff(bytes)) throw InputError(RefusalOfSensorData(path));
  try {
    const int as_stored = orientation == Orientation::kStored ? cv::IMREAD_IGNORE_ORIENTATION : 0;
    const int flags = (color ? cv::IMREAD_COLOR : cv::IMREAD_GRAYSCALE) | as_stored;
    const cv::Mat image = cv::imdecode(bytes, flags | cv::IMREAD_ANYDEPTH);
    if (image.empty() || image.depth() == CV_8U) return image;
    if (image.depth() == CV_16U) return InEightBits(image, bits > 0 ? bits : UsedBits(image));
    return cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

cv::Mat InColor(const cv::Mat& image, const std::string& path, Orientation orientation) {
  if (image.channels() != 1 || path.empty()) return image;
  const cv::Mat color = ReadImage(path, true, orientation, 0);
  return color.size() == image.size() ? color : image;
}

bool NaturalLess(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!IsDigit(a[i]) || !IsDigit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    const size_t begin_a = i, begin_b = j;
    while (i < a.size() && IsDigit(a[i])) ++i;
    while (j < b.size() && IsDigit(b[j])) ++j;
    if (i - begin_a != j - begin_b) return i - begin_a < j - begin_b;
    if (const int order = a.compare(begin_a, i - begin_a, b, begin_b, j - begin_b); order != 0)
      return order < 0;
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;
}

cv::Mat Turned(const cv::Mat& image, int quarters) {
  if (quarters == 0) return image;
  cv::Mat turned;
  cv::rotate(image, turned,
             quarters == 1   ? cv::ROTATE_90_CLOCKWISE
             : quarters == 2 ? cv::ROTATE_180
                             : cv::ROTATE_90_COUNTERCLOCKWISE);
  return turned;
}

bool HasImageExtension(const std::string& path) {
  static constexpr std::array kExtensions = {".png",  ".jpg",  ".jpeg", ".bmp",  ".pgm",
                                             ".ppm",  ".pnm",  ".tif",  ".tiff", ".webp",
                                             ".heic", ".heif", ".hif",  ".avif"};
  return std::ranges::find(kExtensions, LowerExtension(path)) != kExtensions.end();
}

bool IsHelperFile(const std::string& name) {
  static constexpr std::array kNames = {"thumbs.db", "ehthumbs.db", "desktop.ini", "icon\r"};
  const std::string lower = Lower(name);
  return lower.starts_with('.') || std::ranges::find(kNames, lower) != kNames.end() ||
         IsThumbnail(lower);
}

std::vector<std::string> ImageNames(const std::string& folder) {
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error) throw BadInput("{}: {}", folder, error.message());
  std::vector<std::string> names;
  for (const auto& entry : entries) {
    const std::string name = entry.path().filename().string();
    if (!HasImageExtension(name) || IsHelperFile(name) || entry.is_directory(error)) continue;
    if (MayBeImage(entry.path().string()))
      names.push_back(name);
    else
      Log(LogLevel::kWarning, "{}: is no image, passed over", entry.path().string());
  }
  std::ranges::sort(names, NaturalLess);
  return names;
}

std::string FolderOfImagesBelow(const std::string& folder) {
  constexpr int kDeepest = 1;
  std::error_code error;
  std::string first;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied,
                                         error);
  for (const fs::recursive_directory_iterator end; !error && entry != end; entry.increment(error)) {
    if (entry->is_directory(error)) {
      if (entry.depth() > kDeepest) entry.disable_recursion_pending();
      continue;
    }
    const fs::path& path = entry->path();
    const std::string parent = path.parent_path().string();
    if (entry.depth() > 0 && (first.empty() || parent < first) &&
        HasImageExtension(path.string()) && !IsHelperFile(path.filename().string()))
      first = parent;
  }
  return first;
}

}  // namespace oaslam
