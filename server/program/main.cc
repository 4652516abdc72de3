#include <CLI/CLI.hpp>

#include "program.h"
#include "server_commands.h"

namespace {

constexpr const char* kOverview =
    R"(oaslam-server: what `oaslam serve` and `oaslam models` call

Answer cameras over the network:  oaslam serve --maps FOLDER
Get a detector of objects:        oaslam models get yolox_nano
)";

}  // namespace

// It calls itself oaslam in its messages, as it is called.
int main(int argc, char** argv) {
  CLI::App app{"oaslam-server: the localization service, and the catalogue of detectors"};
  oaslam::apps::AddServeCommand(app);
  oaslam::apps::AddModelsCommand(app);
  return oaslam::apps::RunProgram(app, kOverview, argc, argv);
}
