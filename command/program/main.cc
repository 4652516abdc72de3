#include <CLI/CLI.hpp>

#include "commands.h"
#include "program.h"
#include "server_program.h"

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

int Main(int argc, char** argv) {
  using namespace oaslam::apps;
  CLI::App app{"OA-SLAM: monocular SLAM with points and objects that finds its way back"};
  AddRunCommand(app);
  AddDetectCommand(app);
  AddMapObjectsCommand(app);
  AddLocalizeCommand(app);
  AddEvaluateCommand(app);
  AddInfoCommand(app);
  AddObjectsCommand(app);
  AddAnchorsCommand(app);
  AddMergeCommand(app);
  AddExportCommand(app);
  AddViewCommand(app);
  AddOdometryCommand(app);
  AddServerCommands(app);
  return RunProgram(app, kOverview, argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  if (oaslam::apps::IsForServer(argc, argv)) return oaslam::apps::PassToServer(argv);
  return Main(argc, argv);
}
