#include "oaslam_program.h"

#include <CLI/CLI.hpp>
#include <string>
#include <utility>

#include "commands.h"
#include "other_programs.h"
#include "program.h"
#include "run_view.h"

namespace oaslam::apps {
namespace {

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

}  // namespace

int RunOaslam(int argc, char** argv, std::shared_ptr<RunView> view, void (*add_view)(CLI::App&)) {
  if (!view) view = std::make_shared<RunView>();
  const char* other = OtherProgram(argc, argv);
  if (other && !(add_view && other == kViewerProgram)) return PassTo(other, argv);
  const std::string port = std::to_string(view->PortIfLeftOut());
  CLI::App app{"OA-SLAM: monocular SLAM with points and objects that finds its way back"};
  AddRunCommand(app, std::move(view));
  AddDetectCommand(app);
  AddMapObjectsCommand(app);
  AddLocalizeCommand(app);
  AddEvaluateCommand(app);
  AddInfoCommand(app);
  AddObjectsCommand(app);
  AddAnchorsCommand(app);
  AddMergeCommand(app);
  AddExportCommand(app);
  if (add_view) add_view(app);
  AddOdometryCommand(app);
  AddOtherCommands(app);
  return RunProgram(app, kOverview, argc, argv, {{"--follow", "0"}, {"--viewer", port}});
}

}  // namespace oaslam::apps
