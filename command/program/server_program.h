#pragma once

#include <CLI/CLI.hpp>

namespace oaslam::apps {

// `serve` and `models` are commands of oaslam-server, a program of its own, which is looked for
// beside this one and in PATH.

// Tells of them in the help.
void AddServerCommands(CLI::App& app);
// Whether the command line is one of them.
bool IsForServer(int argc, const char* const* argv);
// Becomes oaslam-server with the same arguments. Returns only where that is not installed: the exit
// status, after a message.
int PassToServer(char** argv);

// Where somebody sits at the terminal and oaslam-server is installed, it asks, once for all times,
// whether to fetch the default detector. Returns whether it is there now. Throws CLI::RuntimeError
// after Ctrl-C.
bool OfferDetector();

}  // namespace oaslam::apps
