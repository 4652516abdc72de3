#pragma once

#include <CLI/CLI.hpp>
#include <string_view>

namespace oaslam::apps {

inline constexpr std::string_view kViewerProgram = "oaslam-viewer";

// Some commands are in programs of their own, which are looked for beside this one and in PATH:
// `serve` and `models` in oaslam-server; `view`, and `run` with --viewer or --port, in
// oaslam-viewer.

// Tells in the help of the commands of other programs that `app` does not have itself.
void AddOtherCommands(CLI::App& app);
// The program that the command line is for; null: this one.
const char* OtherProgram(int argc, const char* const* argv);
// Becomes this program, with the same arguments. Returns only where it is not installed: the exit
// status, after a message.
int PassTo(const char* program, char** argv);

// Where somebody sits at the terminal and oaslam-server is installed, it asks, once for all times,
// whether to fetch the default detector. Returns whether it is there now. Throws CLI::RuntimeError
// after Ctrl-C.
bool OfferDetector();

}  // namespace oaslam::apps
