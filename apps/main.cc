#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <exception>

#include "commands.h"
#include "common.h"
#include "help.h"
#include "oaslam/detection/network.h"
#include "oaslam/error.h"
#include "oaslam/images/video_container.h"
#include "oaslam/util/log.h"
#include "optional_values.h"
#include "signals.h"

namespace {

// Messages go to stderr, results to stdout.
void InstallLogger() {
  oaslam::SilenceFfmpeg();
  spdlog::set_default_logger(spdlog::stderr_color_mt("oaslam"));
  oaslam::apps::SetMessagePattern("");
  oaslam::SetLogSink([](oaslam::LogLevel level, const std::string& message) {
    switch (level) {
      case oaslam::LogLevel::kDebug:
        return spdlog::debug(message);
      case oaslam::LogLevel::kInfo:
        return spdlog::info(message);
      case oaslam::LogLevel::kWarning:
        return spdlog::warn(message);
    }
  });
}

// What the command can do, by what a person wants to do.
constexpr const char* kOverview =
    R"(oaslam: SLAM with points and objects, from one camera, that finds its way back

Map a video:                      oaslam run walk.mp4
Look at the map in the browser:   oaslam view walk.oaslam
Watch it grow, from a webcam:     oaslam run webcam:0 --viewer
Find other images in the map:     oaslam localize --map walk.oaslam other.mp4
Answer cameras over the network:  oaslam serve --maps FOLDER
Go on in the map another day:     oaslam run later.mp4 --map-in walk.oaslam
Join two maps made apart:         oaslam merge a.map b.map --out both.map
Motion alone, without a map:        oaslam odometry walk.mp4 --camera FILE --out FILE
Export to Blender, COLMAP, ...:   oaslam export --map FILE --format gltf --out desk.glb
Map objects from known poses:     oaslam map-objects --help
Get a detector of objects:        oaslam models get yolox_nano
Find objects in images:           oaslam detect walk.mp4 --out detections.json
Compare with ground truth:        oaslam evaluate --help
What is in a map, and edit it:    oaslam info FILE, oaslam objects FILE, oaslam anchors FILE

oaslam COMMAND --help lists the options of a command, oaslam --help the commands.
)";

// Nobody gets results that could not be written.
int CheckStdout(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  spdlog::error("standard output: cannot be written");
  return code != 0 ? code : 1;
}

int Main(int argc, char** argv) {
  InstallLogger();
  oaslam::apps::EndOnSignals();
  CLI::App app{"OA-SLAM: monocular SLAM with points and objects that finds its way back"};
  app.name("oaslam");
  app.set_version_flag("--version",
                       fmt::format("oaslam {}\nDetectors are run by {}.", OASLAM_VERSION,
                                   fmt::join(oaslam::NetworkBackends(), " or ")));
  app.require_subcommand(1);
  oaslam::apps::AddRunCommand(app);
  oaslam::apps::AddDetectCommand(app);
  oaslam::apps::AddMapObjectsCommand(app);
  oaslam::apps::AddLocalizeCommand(app);
  oaslam::apps::AddEvaluateCommand(app);
  oaslam::apps::AddInfoCommand(app);
  oaslam::apps::AddObjectsCommand(app);
  oaslam::apps::AddAnchorsCommand(app);
  oaslam::apps::AddMergeCommand(app);
  oaslam::apps::AddExportCommand(app);
  oaslam::apps::AddViewCommand(app);
  oaslam::apps::AddServeCommand(app);
  oaslam::apps::AddModelsCommand(app);
  oaslam::apps::AddOdometryCommand(app);
  oaslam::apps::GroupOptions(app);
  if (argc < 2) {
    fmt::print("{}", kOverview);
    // A script that forgot the command gets an error.
    return 1;
  }
  try {
    app.parse(oaslam::apps::WithOptionalValues(argc, argv));
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    if (const std::string meant = oaslam::apps::DidYouMean(app); code != 0 && !meant.empty())
      fmt::print(stderr, "{}\n", meant);
    return code;
  } catch (const oaslam::InputError& error) {
    spdlog::error(error.what());
    return 1;
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) return oaslam::apps::Interrupted() ? 130 : 1;
    spdlog::error("unexpected: {}", error.what());
    return 2;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) { return CheckStdout(Main(argc, argv)); }
