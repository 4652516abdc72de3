#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "oaslam/models/catalogue.h"

namespace oaslam::apps {

// Fetches a model into the user's folder, with progress on stderr unless quiet. Returns its path;
// nothing after Ctrl-C. Throws InputError.
std::optional<std::filesystem::path> FetchForUser(const PublishedModel& model, bool replace,
                                                  int timeout_s, bool quiet);

// The user's folder of models. Throws InputError where the environment tells none.
std::filesystem::path FolderForModels();

// What a command uses that was given no detector: "default" where that is here, else "none", and
// one line says how to get it. `may_ask`: a user at a terminal is asked whether to fetch it, once
// for all times. Throws CLI::RuntimeError after Ctrl-C.
std::string DefaultDetectorIfHere(bool may_ask);

}  // namespace oaslam::apps
