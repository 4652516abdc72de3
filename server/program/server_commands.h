#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

// Each adds its subcommand; its callback runs it, and throws InputError for bad input.
void AddServeCommand(CLI::App& app);
void AddModelsCommand(CLI::App& app);

}  // namespace oaslam::apps
