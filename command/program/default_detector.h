#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace oaslam::apps {

// The names of the detectors in a folder, which need not exist.
std::set<std::string> DetectorsIn(const std::filesystem::path& folder);

// What a command uses that was given no detector: "default" where that is here, else "none".
std::string DefaultDetectorIfHere();
// The same, but a user at a terminal is asked for it (OfferDetector), and one line says how to get
// it.
std::string DefaultDetectorOrOffer();
// One line that says how to get the default detector, or names another one that is here.
void SayHowToGetDetector();

}  // namespace oaslam::apps
