#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace oaslam::apps {

struct OptionalNumber {
  std::string option, if_left_out;
};

// Parses the command line and with it runs what the subcommands of `app` do. Messages go to stderr,
// results to stdout. `overview`: what is printed without arguments. Returns the exit status.
// `numbers`: options whose value is a number and may be left out.
int RunProgram(CLI::App& app, const char* overview, int argc, char** argv,
               const std::vector<OptionalNumber>& numbers = {});

}  // namespace oaslam::apps
