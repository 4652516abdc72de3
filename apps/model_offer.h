#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include "oaslam/models/catalogue.h"

namespace oaslam::apps {

// Fetches a model into the user's folder, with progress on stderr unless quiet. Returns its path;
// nothing after Ctrl-C. Throws InputError.
std::optional<std::filesystem::path> FetchForUser(const PublishedModel& model, bool replace,
                                                  int timeout_s, bool quiet);

// The user's folder of models. Throws InputError where the environment tells none.
std::filesystem::path FolderForModels();

// The names of the detectors in a folder, which need not exist.
std::set<std::string> DetectorsIn(const std::filesystem::path& folder);

// What a command uses that was given no detector: "default" where that is here, else "none".
std::string DefaultDetectorIfHere();
// The same, but a user at a terminal is asked, once for all times, whether to fetch it where it is
// not here, and one line says how to get it. Throws CLI::RuntimeError after Ctrl-C.
std::string DefaultDetectorOrOffer();
// One line that says how to get the default detector, or names another one that is here.
void SayHowToGetDetector();

}  // namespace oaslam::apps
