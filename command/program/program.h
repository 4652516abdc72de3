#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

// Parses the command line and with it runs what the subcommands of `app` do. Messages go to stderr,
// results to stdout. `overview`: what is printed without arguments. Returns the exit status.
int RunProgram(CLI::App& app, const char* overview, int argc, char** argv);

}  // namespace oaslam::apps
