#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

void AddViewCommand(CLI::App& app);

}  // namespace oaslam::apps
