#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/exports/map_export.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/image_files.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// Time stamps in files are rounded, to 10 microseconds at worst; images of 240 Hz are 4 ms apart.
constexpr double kSameTime_s = 1e-3;

struct KeyframeTime {
  double timestamp = 0;
  KeyframeId id;
};

std::vector<KeyframeTime> SortedTimes(const SavedMap& saved, size_t recording) {
  std::vector<KeyframeTime> times;
  saved.map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
    if (RecordingOf(saved.recordings, k.frame_index) == recording)
      times.push_back({k.timestamp, id});
  });
  std::ranges::stable_sort(times, {}, &KeyframeTime::timestamp);
  return times;
}

size_t RecordingsIn(const SavedMap& saved) { return std::max<size_t>(1, saved.recordings.size()); }

// The folder of a recording in images/, with a slash; empty where it is the only one.
std::string FolderInImages(const SavedMap& saved, size_t recording) {
  return RecordingsIn(saved) > 1 ? FileNameOf(saved.recordings, recording) + "/" : "";
}

void MakeFolder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw BadInput("{}: {}", path.string(), error.message());
}

// Makes a link to a folder of images, instead of an earlier one.
void MakeLink(const fs::path& folder, const fs::path& link) {
  MakeFolder(link.parent_path());
  std::error_code error;
  if (fs::is_symlink(link, error)) fs::remove(link, error);
  fs::create_directory_symlink(folder, link, error);
  if (error) throw BadInput("{}: no link to the images: {}", link.string(), error.message());
}

// The keyframe at a time stamp, the nearest if there are several.
std::optional<KeyframeId> KeyframeAt(const std::vector<KeyframeTime>& times, double timestamp) {
  const auto after = std::ranges::lower_bound(times, timestamp, {}, &KeyframeTime::timestamp);
  std::optional<KeyframeId> best;
  double distance = kSameTime_s;
  for (auto it = after == times.begin() ? after : after - 1; it != times.end() && it <= after; ++it)
    if (std::abs(it->timestamp - timestamp) < distance) {
      distance = std::abs(it->timestamp - timestamp);
      best = it->id;
    }
  return best;
}

KeyframeImages FindListed(const std::vector<KeyframeTime>& times,
                          const std::vector<ListedImage>& listed, const std::string& source,
                          const std::string& folder, const std::string& in_images) {
  const auto absolute = [](const fs::path& path) { return fs::absolute(path).lexically_normal(); };
  const fs::path root =
      fs::is_directory(source) ? absolute(source) : absolute(source).parent_path();
  // Symbolic links are resolved, since ".." of a linked folder is that of its target.
  const fs::path real_folder = fs::weakly_canonical(absolute(folder));
  if (!in_images.empty())
    MakeLink(root, fs::path(folder) / "images" / in_images.substr(0, in_images.size() - 1));
  KeyframeImages images;
  for (const ListedImage& image : listed) {
    const auto id = KeyframeAt(times, image.timestamp);
    if (!id) continue;
    const fs::path path = absolute(image.path);
    const std::string name = path.lexically_relative(root).generic_string();
    if (name.empty() || name == ".") throw BadInput("{}: {} is no image", source, image.path);
    images[*id] = {in_images + name,
                   fs::weakly_canonical(path).lexically_relative(real_folder).generic_string()};
  }
  return images;
}

KeyframeImages ExtractFrames(const std::vector<KeyframeTime>& times, ImageSource& video,
                             const std::string& folder, const std::string& in_images) {
  KeyframeImages images;
  while (const std::optional<InputImage> frame =
             images.size() < times.size() ? video.Next() : std::nullopt) {
    const auto id = KeyframeAt(times, frame->timestamp);
    if (!id || frame->image.empty()) continue;
    const std::string name = fmt::format("{}{:06}.png", in_images, frame->index);
    const std::string path = folder + "/images/" + name;
    MakeFolder(fs::path(path).parent_path());
    std::vector<unsigned char> png;
    cv::imencode(".png", frame->image, png);  // imwrite does not notice a full disk
    WriteTextFile(path, {png.begin(), png.end()});
    images[*id] = {name, "images/" + name};
  }
  return images;
}

}  // namespace

KeyframeImages ImagesByTime(const SavedMap& saved) {
  KeyframeImages images;
  for (size_t recording = 0; recording < RecordingsIn(saved); ++recording) {
    std::optional<std::string> last;
    for (const KeyframeTime& time : SortedTimes(saved, recording)) {
      std::string name = FolderInImages(saved, recording) + fmt::format("{:.6f}", time.timestamp);
      if (last == name)
        name += fmt::format("_{}", time.id.value);  // of a recording that is not told apart
      else
        last = name;
      images[time.id] = {name + ".png", "images/" + name + ".png"};
    }
  }
  return images;
}

std::map<LandmarkId, Rgb> ColorsOfLandmarks(const Map& map, const KeyframeImages& images,
                                            const std::string& folder) {
  struct Sum {
    Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
    int views = 0;
  };
  std::map<LandmarkId, Sum> sums;
  for (const auto& [id, image] : images) {
    const cv::Mat bgr =
        ReadImage((fs::path(folder) / image.path).string(), true, Orientation::kStored, 0);
    if (bgr.empty()) continue;
    const Keyframe& keyframe = map.keyframes.At(id);
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      if (!keyframe.landmarks[i].IsValid()) continue;
      const Eigen::Vector2d px = Distort(map.cameras[static_cast<size_t>(keyframe.camera)],
                                         keyframe.features->keypoints[i].px.cast<double>());
      const cv::Point pixel(cvRound(px.x()), cvRound(px.y()));
      if (!cv::Rect(0, 0, bgr.cols, bgr.rows).contains(pixel)) continue;
      const auto& color = bgr.at<cv::Vec3b>(pixel);
      Sum& sum = sums[keyframe.landmarks[i]];
      sum.rgb += Eigen::Vector3d(color[2], color[1], color[0]);
      ++sum.views;
    }
  }
  std::map<LandmarkId, Rgb> colors;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark&) {
    const auto found = sums.find(id);
    colors[id] = kLandmarkColor;
    if (found == sums.end()) return;
    for (size_t c = 0; c < 3; ++c)
      colors[id][c] = static_cast<unsigned char>(
          std::lround(found->second.rgb[static_cast<Eigen::Index>(c)] / found->second.views));
  });
  return colors;
}

namespace {

KeyframeImages FindImages(const std::vector<KeyframeTime>& times, const std::string& source,
                          const ImageSourceOptions& options, const std::string& folder,
                          const std::string& in_images) {
  for (size_t i = 1; i < times.size(); ++i)
    if (times[i].timestamp - times[i - 1].timestamp < kSameTime_s)
      throw BadInput(
          "{}: keyframes {} and {} of the map are both of time {:.3f} s, from "
          "two runs: their images cannot be told apart",
          source, times[i - 1].id.value, times[i].id.value, times[i].timestamp);
  KeyframeImages images;
  // Other tools read the pixels as they are stored, so that rotated images are written, as those of
  // a video are.
  const bool are_files_right = options.orientation == Orientation::kStored;
  if (const auto listed = ListImages(source, options); listed && are_files_right)
    images = FindListed(times, *listed, source, folder, in_images);
  else if (IsCamera(source))
    throw BadInput("{}: a camera does not keep its images", source);
  else
    images = ExtractFrames(times, *OpenImages(source, options), folder, in_images);
  if (images.empty())
    throw BadInput(
        "{}: no image is of the time of a keyframe ({:.3f} s to {:.3f} s); "
        "did the run use another rate of images (fps)?",
        source, times.front().timestamp, times.back().timestamp);
  if (images.size() < times.size())
    Log(LogLevel::kWarning, "{}: {} of {} keyframes have no image, left out", source,
        times.size() - images.size(), times.size());
  return images;
}

}  // namespace

KeyframeImages FindImages(const SavedMap& saved, const std::vector<std::string>& sources,
                          const ImageSourceOptions& options, const std::string& folder) {
  KeyframeImages images;
  for (size_t i = 0; i < sources.size(); ++i)
    if (const auto times = SortedTimes(saved, i); !times.empty())
      images.merge(FindImages(times, sources[i], options, folder, FolderInImages(saved, i)));
  return images;
}

}  // namespace oaslam
