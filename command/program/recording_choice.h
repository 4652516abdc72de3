#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/storage/recordings.h"

namespace CLI {
class App;
}

namespace oaslam::apps {

// The path of images as a map keeps it; empty for a camera.
std::string ImagesOnDisk(const std::string& images);
// What a recording of these images is called.
std::string NameOfImages(const std::string& images);

void AddRecordingOption(CLI::App& command, std::string& recording);

// The recording that `recording` or the only one of `images` names; nothing: all. Images that may
// be of any of several recordings are refused.
std::optional<size_t> ChosenRecording(const std::string& recording,
                                      const std::vector<std::string>& images,
                                      const MapRecordings& recordings);

// Where the images of each recording are: `images`, with where they were for "auto". Throws
// InputError where their number is wrong, or it is not known where they were.
std::vector<std::string> SourcesOf(const std::vector<std::string>& images,
                                   const MapRecordings& recordings);

}  // namespace oaslam::apps
