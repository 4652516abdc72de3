#pragma once

#include <filesystem>
#include <optional>

#include "oaslam/models/catalogue.h"

namespace oaslam::apps {

// Fetches a model into the user's folder, with progress on stderr unless quiet. Returns its path;
// nothing after Ctrl-C. Throws InputError.
std::optional<std::filesystem::path> FetchForUser(const PublishedModel& model, bool replace,
                                                  int timeout_s, bool quiet);

// The user's folder of models. Throws InputError where the environment tells none.
std::filesystem::path FolderForModels();

// Asks the user at the terminal, once for all times, whether to fetch the default detector, and
// fetches it. Returns the exit status: 0 where it was fetched, 130 after Ctrl-C.
int OfferDefaultModel();

}  // namespace oaslam::apps
