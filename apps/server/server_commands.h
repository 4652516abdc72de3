#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

// Each adds its subcommand, as those of commands.h do.
void AddServeCommand(CLI::App& app);
void AddModelsCommand(CLI::App& app);

}  // namespace oaslam::apps
