#include "recording_choice.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

namespace fs = std::filesystem;

std::string AbsolutePath(const std::string& path) {
  std::error_code error;
  const std::string absolute = fs::absolute(path, error).lexically_normal().string();
  return absolute.size() > 1 && absolute.ends_with('/') ? absolute.substr(0, absolute.size() - 1)
                                                        : absolute;
}

std::string PlaceOfImages(const MapRecordings& recordings, size_t recording) {
  const std::string images = recordings.empty() ? "" : recordings[recording].images;
  if (images.empty())
    throw BadInput("--images auto: the map does not know where the images of recording {} were",
                   Describe(recordings, recording));
  return images;
}

}  // namespace

std::string ImagesOnDisk(const std::string& images) {
  std::error_code error;
  return fs::exists(images, error) ? AbsolutePath(images) : "";
}

std::string NameOfImages(const std::string& images) {
  const fs::path path = ImagesOnDisk(images);
  if (path.empty()) return images;
  std::error_code error;
  return (fs::is_directory(path, error) ? path.filename() : path.stem()).string();
}

void AddRecordingOption(CLI::App& command, std::string& recording) {
  command
      .add_option("--recording", recording,
                  "only this recording of a map of several (oaslam info lists them): its number or "
                  "name")
      ->type_name("N|NAME");
}

std::optional<size_t> ChosenRecording(const std::string& recording,
                                      const std::vector<std::string>& images,
                                      const MapRecordings& recordings) {
  if (!recording.empty()) return FindRecording(recordings, recording);
  if (recordings.size() < 2 || images.size() != 1 || images[0] == "auto") return std::nullopt;
  std::vector<size_t> found;
  for (size_t i = 0; i < recordings.size(); ++i)
    if (recordings[i].images == AbsolutePath(images[0])) found.push_back(i);
  if (found.size() != 1)
    throw BadInput(
        "--images {}: the map is of {} recordings: {}. Say by --recording whose images "
        "these are, or give --images for each, in this order",
        images[0], recordings.size(), Describe(recordings));
  spdlog::info("--images {}: of recording {}, which alone of {} is taken", images[0],
               Describe(recordings, found[0]), recordings.size());
  return found[0];
}

std::vector<std::string> SourcesOf(const std::vector<std::string>& images,
                                   const MapRecordings& recordings) {
  const size_t count = std::max<size_t>(1, recordings.size());
  std::vector<std::string> sources = images;
  if (sources.size() == 1) sources.resize(count, sources[0]);
  if (sources.size() != count)
    throw BadInput("--images: given {} times for {} recordings: {}", sources.size(), count,
                   Describe(recordings));
  for (size_t i = 0; i < count; ++i)
    if (sources[i] == "auto") sources[i] = PlaceOfImages(recordings, i);
  return sources;
}

}  // namespace oaslam::apps
