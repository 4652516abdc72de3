#include "default_detector.h"

#include <spdlog/spdlog.h>

#include "oaslam/detection/model_folders.h"
#include "other_programs.h"

namespace oaslam::apps {

namespace fs = std::filesystem;

std::string DefaultDetectorIfHere() { return FindModel(kDefaultModel) ? "default" : "none"; }

std::string DefaultDetectorOrOffer() {
  if (FindModel(kDefaultModel) || OfferDetector()) return "default";
  SayHowToGetDetector();
  return "none";
}

std::set<std::string> DetectorsIn(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(folder, error)) {
    const std::string name = file.path().stem().string();
    if (file.path().filename() == FileOfModel(name) && IsModelName(name)) names.insert(name);
  }
  return names;
}

void SayHowToGetDetector() {
  std::string other;
  for (const fs::path& folder : ModelFolders())
    if (const auto names = DetectorsIn(folder); other.empty() && !names.empty())
      other = *names.begin();
  if (other.empty())
    spdlog::info(
        "points alone, no objects: no detector is here. `oaslam models get {}` fetches one, "
        "--detector NAME or FILE uses another",
        kDefaultModel);
  else
    spdlog::info(
        "points alone, no objects: the default detector is not here. `oaslam models get {}` "
        "fetches it, --detector {} uses one that is here",
        kDefaultModel, other);
}

}  // namespace oaslam::apps
