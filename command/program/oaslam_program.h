#pragma once

#include <memory>

#include "run_view.h"

namespace oaslam::apps {

// The command `oaslam`: runs what the command line asks for, or becomes the program that does
// (other_programs.h). `view` shows runs; a program that has the command `view` gives `add_view`,
// which adds it. Returns the exit status.
int RunOaslam(int argc, char** argv, std::shared_ptr<RunView> view,
              void (*add_view)(CLI::App&) = nullptr);

}  // namespace oaslam::apps
