#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace oaslam::apps {

class RunView;

// The command `oaslam`: runs what the command line asks for, or becomes the program that does
// (other_programs.h). `view` shows runs; null: nothing does. `add_view` adds the command `view`;
// null: that is another program's. Returns the exit status.
int RunOaslam(int argc, char** argv, std::shared_ptr<RunView> view = nullptr,
              void (*add_view)(CLI::App&) = nullptr);

}  // namespace oaslam::apps
