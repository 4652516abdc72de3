#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

// Adds the subcommand `view`.
void AddViewCommand(CLI::App& app);

}  // namespace oaslam::apps
