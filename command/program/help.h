#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace oaslam::apps {

// Sorts the options of each command that has many into groups: of a robot, input, camera, objects,
// output, live, more. Gives each command --help-all; where --help would be too long, it shows a
// part. To be called once all commands are added.
void GroupOptions(CLI::App& app);

// After a command line that was refused: its first option that the command does not have; empty
// where there is none.
std::string UnknownOption(const CLI::App& app);

// After a command line that was refused: the command or option that is written nearly as one of its
// words, in a sentence; empty where there is none.
std::string DidYouMean(const CLI::App& app);

}  // namespace oaslam::apps
