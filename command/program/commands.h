#pragma once

#include <CLI/CLI.hpp>
#include <memory>

#include "run_view.h"

namespace oaslam::apps {

// Each adds its subcommand to the application; its callback runs it, and throws InputError for bad
// input.
void AddDetectCommand(CLI::App& app);
void AddRunCommand(CLI::App& app, std::shared_ptr<RunView> view);
void AddMapObjectsCommand(CLI::App& app);
void AddLocalizeCommand(CLI::App& app);
void AddEvaluateCommand(CLI::App& app);
void AddInfoCommand(CLI::App& app);
void AddObjectsCommand(CLI::App& app);
void AddAnchorsCommand(CLI::App& app);
void AddMergeCommand(CLI::App& app);
void AddExportCommand(CLI::App& app);
void AddOdometryCommand(CLI::App& app);

}  // namespace oaslam::apps
