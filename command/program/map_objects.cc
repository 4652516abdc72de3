#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "commands.h"
#include "common.h"
#include "detection_choice.h"
#include "detector_options.h"
#include "failures.h"
#include "map_out.h"
#include "mask_choice.h"
#include "oaslam/camera_file.h"
#include "oaslam/detection_file.h"
#include "oaslam/evaluation/alignment.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/map/frame.h"
#include "oaslam/objects/known_poses.h"
#include "oaslam/pictures/map_results.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/stopwatch.h"
#include "timed_detections.h"

namespace oaslam::apps {
namespace {

struct Options {
  CommonOptions common;
  std::string trajectory, camera, detections, out, map_out, mask;
};

std::vector<PosedDetections> PoseDetections(const Options& options, const Camera& camera,
                                            std::vector<ImageDetections> detected) {
  const std::vector<StampedPose> poses = LoadTrajectory(options.trajectory);
  std::vector<TimedDetections> images = SelectTimedDetections(DetectionTable(std::move(detected)),
                                                              options.detections, options.common);
  const cv::Mat mask = MaskFor(options.mask, options.camera, "", options.common);
  for (TimedDetections& image : images) EraseHidden(mask, image.detections);
  std::vector<PosedDetections> frames;
  for (const TimedDetections& image : images) {
    const StampedPose* pose = NearestInTime(poses, image.timestamp);
    if (!pose) continue;
    std::vector<ObjectDetection> detections = IdealDetections(camera, image.detections);
    std::erase_if(detections, [](const ObjectDetection& d) { return d.box.Area() <= 0; });
    frames.push_back(
        {image.index, image.timestamp, pose->world_from_cam.Inverse(), std::move(detections)});
  }
  if (frames.empty())
    throw BadInput("{}: none of its poses is within {} s of an image of {}", options.trajectory,
                   kMaxTimeDifference, options.detections);
  if (frames.size() < images.size())
    spdlog::warn("{} of {} images have no pose within {} s: skipped", images.size() - frames.size(),
                 images.size(), kMaxTimeDifference);
  return frames;
}

void WriteResults(const Options& options, const KnownPoseMap& result, const ClassNames& names,
                  size_t frames, const Stopwatch& watch, MapOut& map_out) {
  const std::filesystem::path out(options.out);
  SavedMap saved{result.map, {}, names};
  saved.recordings = {{std::filesystem::path(options.detections).stem().string(), "", 0}};
  std::vector<StampedPose> trajectory;
  result.map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    trajectory.push_back({keyframe.timestamp, keyframe.cam_from_world.Inverse()});
    saved.trajectory.push_back(
        {keyframe.frame_index, keyframe.timestamp, id, Rigid3(), TrackingState::kTracking});
  });
  const int objects = result.map.CountMappedObjects();
  Failures failures;
  for (const char* name : {"trajectory.txt", "keyframes.txt"})
    failures.Try([&] { SaveTrajectory((out / name).string(), trajectory); });
  failures.Try([&] { SaveObjectsJson((out / "objects.json").string(), result.map, names); });
  const MapPlot plot{.map = &result.map,
                     .trajectory = trajectory,
                     .names = names,
                     .title = fmt::format("{} objects from {} known poses", objects, frames)};
  failures.Try([&] { SaveMapSvg((out / "map.svg").string(), plot); });
  failures.Try([&] { map_out.Save(saved); });
  const double wall_s = watch.WallMs() / 1000, ms = wall_s * 1000 / static_cast<double>(frames);
  const nlohmann::ordered_json summary = {{"version", OASLAM_VERSION},
                                          {"mode", "map-objects"},
                                          {"frames", frames},
                                          {"tracked", frames},
                                          {"keyframes", frames},
                                          {"landmarks", 0},
                                          {"objects", objects},
                                          {"loops", 0},
                                          {"ms_mean", ms},
                                          {"cpu_s", ProcessCpuSeconds()},
                                          {"wall_s", wall_s},
                                          {"peak_rss_mb", PeakRssMb()},
                                          {"mean_iou", result.mean_iou}};
  failures.Try(
      [&] { WriteTextFile((out / "summary.json").string(), JsonText(summary, 2) + "\n"); });
  failures.Throw();
  if (!options.common.quiet)
    fmt::print("{} objects from {} images, mean IoU {:.3f}, in {:.1f} s\n", objects, frames,
               result.mean_iou, wall_s);
}

void MapObjects(const Options& options) {
  const Stopwatch watch;
  const SlamConfig config = LoadConfiguration(options.common);
  DetectionFile detections = LoadDetectionsFor(options.detections, options.common);
  const Classes classes = ClassesFor(options.common, nullptr, detections.categories);
  const Camera camera = LoadCamera(options.camera, {0, 0});
  ConvertShares(camera.width, camera.height, detections);
  CheckNames(detections, options.detections);
  const std::vector<PosedDetections> frames =
      PoseDetections(options, camera, std::move(detections.images));
  const OutputFolder folder(options.out);
  const OutputFolder map_folder = options.map_out.empty()
                                      ? OutputFolder(options.out)
                                      : FolderOfMapFile(options.map_out, "--map-out");
  MapOut map_out(options.map_out);
  ProgressBar progress(static_cast<int>(frames.size()), options.common.quiet);
  const KnownPoseMap result =
      MapObjectsFromKnownPoses(frames, camera, config.objects, classes.relations,
                               [&](int done) { progress.Update(done, "mapping objects"); });
  progress.Finish();
  WriteResults(options, result, classes.names, frames.size(), watch, map_out);
}

}  // namespace

void AddMapObjectsCommand(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "map-objects", "Map objects from poses that are already known (ARKit, COLMAP, another SLAM)");
  command->add_option("--trajectory", options->trajectory, "Poses, TUM format, camera to world")
      ->required()
      ->type_name("TUM")
      ->check(CLI::ExistingFile);
  command->add_option("--camera", options->camera, "Calibration file")
      ->required()
      ->type_name("CAM");
  command->add_option("--detections", options->detections, "Detections; names are time stamps")
      ->required()
      ->type_name("JSON")
      ->check(CLI::ExistingFile);
  command->add_option("--out", options->out, "Output folder")->required()->type_name("DIR");
  command->add_option("--map-out", options->map_out, "Also save the map")->type_name("FILE");
  AddMaskOption(*command, options->mask);
  AddCommonOptions(*command, options->common);
  command->callback([options] { MapObjects(*options); });
}

}  // namespace oaslam::apps
