#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

// Each adds its subcommand to the application; its callback runs it, and throws InputError for bad
// input.
void AddDetectCommand(CLI::App& app);
void AddRunCommand(CLI::App& app);
void AddMapObjectsCommand(CLI::App& app);
void AddLocalizeCommand(CLI::App& app);
void AddEvaluateCommand(CLI::App& app);
void AddInfoCommand(CLI::App& app);
void AddObjectsCommand(CLI::App& app);
void AddAnchorsCommand(CLI::App& app);
void AddMergeCommand(CLI::App& app);
void AddExportCommand(CLI::App& app);
void AddViewCommand(CLI::App& app);
void AddOdometryCommand(CLI::App& app);

// Each adds its subcommand, as those of commands.h do.
void AddServeCommand(CLI::App& app);
void AddModelsCommand(CLI::App& app);

}  // namespace oaslam::apps
