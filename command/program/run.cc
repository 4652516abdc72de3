#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <utility>

#include "beside.h"
#include "camera_choice.h"
#include "commands.h"
#include "common.h"
#include "dataset_choice.h"
#include "failures.h"
#include "frame_inputs.h"
#include "map_out.h"
#include "mask_choice.h"
#include "metric_scale.h"
#include "oaslam/bundle/rolling_shutter.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/playback_clock.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/slam.h"
#include "oaslam/util/stopwatch.h"
#include "oaslam/util/uri.h"
#include "recorded_inputs.h"
#include "recording.h"
#include "recording_choice.h"
#include "run_results.h"
#include "run_view.h"

namespace oaslam::apps {
namespace {

struct RunOptions {
  CommonOptions common;
  PlainForm plain;
  DetectorSettings detector;
  SideFiles side;
  ScaleSettings scale;
  std::shared_ptr<RunView> view;
  RecordingSettings recording;
  CameraSettings camera;
  std::string images, out, map_out, map_in, mode, relocalization = "points+objects", groundtruth,
                                                  mask;
  std::optional<int> seed;
  std::optional<double> readout_ms;
};

SlamConfig Configure(const RunOptions& options) {
  CommonOptions common = options.common;
  if (!options.mode.empty()) common.set.push_back("runner.mode=" + options.mode);
  if (options.seed) common.set.push_back(fmt::format("runner.seed={}", *options.seed));
  SlamConfig defaults = SlamConfig::Offline();
  if (options.plain.IsUsed() && IsCamera(options.images)) defaults.runner.mode = RunnerMode::kLive;
  return LoadConfiguration(common, defaults);
}

// Whether an image of a recording that is played as a camera would give it comes too late: the next
// one is due already. Else waits until the image is due.
bool IsLate(PlaybackClock& playback, double timestamp, double interval_s) {
  const double now = SteadySeconds(), due = playback.Due(timestamp, now);
  if (due - now < -interval_s) return true;
  SleepUnlessInterrupted(due - now);
  return false;
}

void AddLateDetections(FrameInputs& inputs, Slam& slam, RunView& view, RunResults& results) {
  for (const BackgroundDetector::Result& found : inputs.TakeLate()) {
    results.Detected(found.frame, static_cast<int>(found.detections.size()),
                     slam.AddDetections(found.frame, found.detections));
    view.ShowLate(found.frame, found.detections);
  }
}

std::optional<Camera> CameraOfMap(const std::string& path) {
  if (path.empty()) return std::nullopt;
  const std::vector<Camera> cameras = LoadMap(path).map.cameras;
  return cameras.empty() ? std::nullopt : std::optional(cameras.back());
}

// Returns the error if the scale is not available; then everything keeps its unit, and should be
// saved nevertheless.
std::exception_ptr ScaleToMetres(const MetricScale& scale, SavedMap& saved,
                                 std::vector<StampedPose>& trajectory, RunResults& results,
                                 std::string& why_arbitrary) {
  try {
    const UnitChange change = scale.ChangeOf(saved, trajectory);
    why_arbitrary = change.why_not;
    Apply(change, saved);
    if (change.metres_per_unit) {
      for (StampedPose& pose : trajectory)
        pose.world_from_cam.translation *= *change.metres_per_unit;
      results.Scale(*change.metres_per_unit);
    }
    scale.WarnOfContradiction(saved, trajectory);
    return nullptr;
  } catch (const InputError&) {
    return std::current_exception();
  }
}

// Estimates the camera before the run, unless it is given.
std::optional<CameraEstimate> EstimateFor(const RunOptions& options, const SlamConfig& config,
                                          const cv::Mat& mask) {
  if (!options.camera.IsEstimated()) return std::nullopt;
  return EstimateCamera(options.camera, options.images, CameraOfMap(options.map_in), mask, config,
                        options.common);
}

// Refines the camera by the whole map, and converts the map to it.
std::optional<CameraEstimate> LastEstimate(const std::optional<CameraEstimate>& first,
                                           const SlamConfig& config, bool find_readout,
                                           SavedMap& saved) {
  if (!first) return std::nullopt;
  CameraEstimate estimate = *first;
  RefineWithMap(config, find_readout, estimate, saved);
  if (estimate.is_determined)
    spdlog::info("camera: {}, estimated from the images", Describe(estimate));
  else if (!saved.map.keyframes.empty())
    spdlog::warn("camera: not determined by the images: {}; expect a bent map", estimate.why_not);
  return estimate;
}

// The last steps on the whole map: corrects for a rolling shutter, and estimates a camera that was
// not given. If it throws, the map is unchanged.
std::optional<CameraEstimate> RefineWholeMap(const RunOptions& options, const SlamConfig& config,
                                             const std::optional<CameraEstimate>& first,
                                             SavedMap& saved) {
  SavedMap refined = saved;
  if (options.readout_ms) {
    const auto undo = [&](const Map& map, const std::vector<FramePose>& trajectory) {
      Map still = WithoutReadout(map, trajectory, *options.readout_ms / 1000, config.bundle);
      RefitMovedObjects(config.objects, still);
      return still;
    };
    refined.map = undo(refined.map, refined.trajectory);
    for (Submap& submap : refined.submaps) submap.map = undo(submap.map, submap.trajectory);
  }
  std::optional<CameraEstimate> estimate =
      LastEstimate(first, config, !options.readout_ms, refined);
  saved = std::move(refined);
  return estimate;
}

// Fills in what the command line leaves out.
RunOptions Complete(RunOptions options) {
  Complete(options.plain, ".oaslam",
           {options.images, options.side.detections, options.detector, options.out});
  if (options.plain.IsUsed() && options.map_out.empty())
    options.map_out = options.out + "/map.oaslam";
  if (options.images.empty()) throw InputError("run: no images given: oaslam run PATH");
  if (options.out.empty()) throw InputError("run: --images needs --out");
  return options;
}

// The path of the images, so that `oaslam view` finds them; empty where it could not read them with
// the same time stamps.
std::string PathToFindAgain(const RunOptions& options) {
  std::error_code error;
  if (IsCamera(options.images) || options.common.fps || options.common.follow_s ||
      !options.common.time_unit.empty() || !options.common.dataset.empty() ||
      !options.common.topic.empty() || options.common.exif_rotation)
    return "";
  return std::filesystem::absolute(options.images, error).lexically_normal().string();
}

void SayDetectorPace(const RunOptions& options, const DetectorPace& pace, int images) {
  if (options.detector.IsGiven())
    spdlog::info("detector: {}, {} of {} images looked at", NameOfDetector(options.detector),
                 pace.images, images);
}

// Says what the objects tell of the unit; of a map without objects nothing.
void SayUnit(const Map& map, const std::string& why_arbitrary) {
  if (map.unit_evidence)
    fmt::print("unit: {}\n", DescribeUnit(map));
  else if (!map.is_metric && !why_arbitrary.empty() && map.CountMappedObjects() > 0)
    fmt::print("unit: arbitrary: {}\n", why_arbitrary);
}

// The classes that a run is given. A file of classes applies from now on; without one a loaded map
// keeps its relations.
struct RunClasses {
  Classes classes;
  bool has_names = false;  // of a detector or of detections
  bool has_file = false;

  void Give(Slam& slam, bool is_loaded) const {
    if (!is_loaded || has_names || has_file) slam.SetClassNames(classes.names);
    if (has_file) slam.SetClassRelations(classes.relations);
  }
};

// Where what an image tells is shown and kept.
struct Sinks {
  RunView& view;
  Recording& recording;
  RunResults& results;
};

// Seconds since the camera took the image; empty: of a file.
std::optional<double> AgeOf(const FrameInput& frame) {
  if (!frame.taken_s) return std::nullopt;
  return SteadySeconds() - *frame.taken_s;
}

void Take(const Slam& slam, const FrameInput& frame, const TrackingResult& result, int dropped,
          Sinks& sinks) {
  sinks.results.Add(frame.index, result);
  if (const auto age = AgeOf(frame)) sinks.results.AddAge(*age);
  sinks.view.Show(slam, frame, result, dropped);
  sinks.recording.Add(slam, frame, result);
}

std::string Describe(const FrameInput& frame, const TrackingResult& result) {
  std::string state = ToString(result.state);
  if (result.inliers) state += fmt::format(", {} points", *result.inliers);
  if (const auto age = AgeOf(frame)) state += fmt::format(", {:.2f} s old", *age);
  return state;
}

struct ImageCounts {
  int done = 0, dropped = 0;
};

// Tracks the images until they end or the run is interrupted. `reset`: what a viewer may ask for.
void ProcessImages(FrameInputs& inputs, Slam& slam, bool drops_late,
                   const std::function<void()>& reset, Sinks& sinks, ProgressBar& progress,
                   ImageCounts& counts) {
  PlaybackClock playback;
  double last = std::numeric_limits<double>::lowest();
  while (!Interrupted()) {
    playback.Delay(sinks.view.Obey(slam, reset));
    if (Interrupted()) break;
    std::optional<FrameInput> frame = inputs.Next();
    if (!frame) break;
    const double timestamp = frame->input.timestamp;
    if (drops_late && IsLate(playback, timestamp, timestamp - std::exchange(last, timestamp))) {
      ++counts.dropped;
      inputs.KeepSamples(*frame);
      continue;
    }
    sinks.view.Prepare(slam, *frame);
    const TrackingResult result = slam.Process(frame->input);
    inputs.SetState(result.state);
    Take(slam, *frame, result, counts.dropped, sinks);
    const std::optional<Vertical> vertical = VerticalIn(slam, *frame, result);
    inputs.SetVertical(vertical);
    inputs.DetectLate(result.frame, frame->input.image, vertical);
    AddLateDetections(inputs, slam, sinks.view, sinks.results);
    progress.Update(++counts.done, Describe(*frame, result));
  }
  if (!Interrupted()) inputs.FinishLate();
  AddLateDetections(inputs, slam, sinks.view, sinks.results);
}

// What was written, and what is said of it.
struct Written {
  SavedMap map;
  size_t tracked = 0;
  std::string uncertain, loose, why_arbitrary;
};

// Writes the map of a run and what belongs to it.
struct RunWriter {
  const RunOptions& options;
  const MetricScale& scale;
  const std::vector<StampedPose>& groundtruth;
  const RunResults& results;
  Camera camera;    // as it was given, or estimated before the run
  int first_frame;  // earlier ones belong to the map that the run began with
  double start_s;
  const ObjectsConfig& objects;
  MapOut& map_out;

  // Changes only copies, so that it may be called twice.
  Written Write(SavedMap saved, WorldId world, const std::vector<FormerWorld>& former,
                const std::optional<CameraEstimate>& estimate, Failures& failures) const {
    Written written;
    map_out.TakeOverEdits(objects, saved.map);
    RunResults files = results;
    files.SetWorld(world, former);
    files.SetCamera(estimate ? estimate->camera : camera, estimate);
    std::vector<StampedPose> trajectory = WorldPoses(saved.map, saved.trajectory, first_frame);
    failures.Add(ScaleToMetres(scale, saved, trajectory, files, written.why_arbitrary));
    std::vector<std::vector<StampedPose>> submaps;
    for (const Submap& submap : saved.submaps)
      submaps.push_back(WorldPoses(submap.map, submap.trajectory, first_frame));
    failures.Try([&] {
      written.tracked = files.Finish(saved, trajectory, submaps, groundtruth,
                                     SteadySeconds() - start_s, Interrupted());
    });
    failures.Try([&] { map_out.Save(saved); });
    written.map = std::move(saved);
    written.uncertain = files.Uncertain();
    written.loose = files.Loose();
    return written;
  }
};

// Finishes the map, improves it as a whole, and writes it. Who ends the run meanwhile has it as it
// was before.
Written FinishAndWrite(Slam& slam, const RunWriter& writer, const SlamConfig& config,
                       const std::optional<CameraEstimate>& first_estimate, Failures& failures) {
  const WorldId world = slam.Snapshot().world();
  const std::vector<FormerWorld> former = slam.FormerWorlds();
  const SavedMap unfinished = SavedMapOf(slam.WholeMap());
  SavedMap finished;
  std::optional<CameraEstimate> estimate = first_estimate;
  auto finishing = std::async(std::launch::async, [&] {
    failures.Try([&] { slam.Finish(); });
    finished = SavedMapOf(slam.WholeMap());
    failures.Try(
        [&] { estimate = RefineWholeMap(writer.options, config, first_estimate, finished); });
  });
  // This only improves the map, and may take longer than who ends the run will wait.
  if (!IsReadyUnlessInterrupted(finishing)) {
    Failures early;
    writer.Write(unfinished, world, former, first_estimate, early);
    if (!early.Any()) SavedOnSignal();
  }
  finishing.get();
  return writer.Write(std::move(finished), slam.Snapshot().world(), slam.FormerWorlds(), estimate,
                      failures);
}

void Say(const Written& written, const RunOptions& options, int images) {
  const Map& map = written.map.map;
  if (options.common.quiet) return;
  fmt::print("{} of {} frames tracked, {} keyframes, {} landmarks, {} objects; results in {}{}\n",
             written.tracked, images, map.keyframes.size(), map.landmarks.size(),
             map.CountMappedObjects(), options.out,
             options.map_out.empty() ? "; the map is not saved (--map-out)" : "");
  SayUnit(map, written.why_arbitrary);
  for (const std::string& doubt : {written.uncertain, written.loose})
    if (!doubt.empty()) fmt::print("{}\n", doubt);
  if (options.plain.IsUsed() && !map.keyframes.empty())
    fmt::print("to look at it: oaslam view {}\n", options.out);
}

void Run(const RunOptions& given) {
  RunOptions options = Complete(given);
  const SlamConfig config = Configure(options);
  const bool is_live = config.runner.mode == RunnerMode::kLive;
  if (is_live) spdlog::info("live: images that come too late are dropped");
  std::vector<StampedPose> groundtruth;
  if (!options.groundtruth.empty())
    groundtruth = LoadGroundtruth(options.groundtruth, options.common, options.images);
  TakeDataset(options.images, options.common,
              {&options.camera.camera, &options.side, &groundtruth, options.side.DepthOfDataset()});

  TakeRecording(options.images, options.common,
                {&options.camera.camera, &options.side,
                 given.detector.model.empty() ? &options.detector : nullptr});
  options.camera.recorded = options.side.recorded_camera;

  // What is refused is refused before anything is written or estimated.
  SideInputs side(options.side, options.camera.camera, options.detector, options.common);
  const RunClasses classes{ClassesFor(options.common, side.detector.get(), side.categories),
                           side.detector != nullptr || !side.categories.empty(),
                           !options.common.classes.empty()};
  const MetricScale scale(options.scale, classes.classes.names, groundtruth);
  options.view->Check();
  const OutputFolder folder(options.out);
  const OutputFolder map_folder = options.map_out.empty()
                                      ? OutputFolder(options.out)
                                      : FolderOfMapFile(options.map_out, "--map-out");
  MapOut map_out(options.map_out);
  Recording recording(options.recording, options.images);
  if (options.camera.camera.empty())
    if (const auto camera = options.view->CameraOfSource(options.images))
      side.recorded_camera = options.camera.recorded = camera;
  const cv::Mat mask = MaskFor(options.mask, options.camera.camera, options.images, options.common);
  const std::optional<CameraEstimate> first_estimate = EstimateFor(options, config, mask);
  FrameInputs inputs(
      {options.images, options.camera.camera, options.detector, is_live,
       options.view->IsAskedFor() || options.recording.IsAskedFor(), !options.map_in.empty(),
       first_estimate ? std::optional(first_estimate->camera) : std::nullopt},
      std::move(side), options.common);

  Slam slam(config, inputs.camera());
  slam.SetRelocalizationMode(RelocalizationModeOf(options.relocalization));
  slam.SetImu(inputs.cam_from_imu());
  if (!options.map_in.empty()) {
    slam.Load(options.map_in);
    map_out.BeginsWith(options.map_in, *MapOf(slam.Snapshot()));
  }
  UseMask(options.mask, mask, slam, inputs.camera());
  slam.NameRecording(NameOfImages(options.images), ImagesOnDisk(options.images));
  int first_frame = FramesOf(SavedMapOf(slam.WholeMap()));
  classes.Give(slam, !options.map_in.empty());
  const auto reset = [&] {
    slam.Reset();
    first_frame = 0;
    map_out.BeginsAnew();
    classes.Give(slam, false);
  };
  RunResults results(options.out, config);
  if (options.plain.IsUsed()) results.SetImages(PathToFindAgain(options));
  options.view->Begin(WithoutPassword(options.images), slam, groundtruth, options.common.quiet);
  recording.Begin(slam, inputs.camera());

  ProgressBar progress(inputs.size(), options.common.quiet);
  const double start_s = SteadySeconds();
  Sinks sinks{*options.view, recording, results};
  ImageCounts counts;
  Failures failures;  // reported after all results have been saved
  InstallInterruptHandler();
  failures.Try([&] {
    ProcessImages(inputs, slam, is_live && !inputs.is_live(), reset, sinks, progress, counts);
  });
  failures.Try([&] { recording.Finish(); });
  inputs.ReportSensors(slam.Imu());
  results.SetDetectorPace(inputs.pace(), SteadySeconds() - start_s);
  progress.Finish();
  SayDetectorPace(options, inputs.pace(), counts.done);

  const RunWriter writer{options,     scale,   groundtruth,    results, inputs.camera(),
                         first_frame, start_s, config.objects, map_out};
  const Written written = FinishAndWrite(slam, writer, config, first_estimate, failures);
  map_out.Release();
  const bool interrupted = Interrupted();
  if (const int dropped = counts.dropped + inputs.dropped(); dropped > 0)
    spdlog::warn("{} images came too late and were dropped", dropped);
  failures.Throw();
  Say(written, options, counts.done);
  options.view->Finish(written.map, interrupted);
  if (interrupted) EndIfInterrupted();
}

}  // namespace

void AddRunCommand(CLI::App& app, std::shared_ptr<RunView> view) {
  auto* command =
      app.add_subcommand("run", "SLAM on images: trajectory, map of points and objects");
  const auto options = std::make_shared<RunOptions>();
  options->view = std::move(view);
  auto* images = command->add_option("--images", options->images,
                                     "folder of a dataset or of images, list file, video, "
                                     "recording of ROS (.mcap, .bag, rosbag2), "
                                     "or camera (webcam:0, rtsp://...)");
  AddPlainForm(*command, options->plain, images);
  AddCameraOptions(*command, options->camera);
  AddMaskOption(*command, options->mask);
  auto* detections =
      command->add_option("--detections", options->side.detections,
                          "the boxes of all images: JSON, CSV, or a folder of YOLO's texts");
  AddDetectorOptions(*command, options->detector)->excludes(detections);
  AddDetectEveryOption(*command, options->detector);
  command->add_option("--out", options->out, "folder for the results; by default beside PATH");
  command->add_option("--map-out", options->map_out, "save the map to this file");
  command->add_option("--map-in", options->map_in,
                      "start from this map: relocalize in it, go on mapping");
  command->add_option("--mode", options->mode, "sequential, lockstep (default) or live");
  AddRelocalizationOption(*command, options->relocalization, "by what a lost camera is found");
  command
      ->add_option("--rolling-shutter", options->readout_ms,
                   "milliseconds in which the camera reads out an image, top row to bottom row: "
                   "corrected in the last optimisation; estimated with --camera auto")
      ->type_name("MS")
      ->check(CLI::Range(-100.0, 100.0));
  command->add_option("--groundtruth", options->groundtruth,
                      "TUM trajectory, or the folder of a dataset, to compare with");
  command->add_option(
      "--gravity", options->side.gravity,
      "gravity in the camera's frame, for the map's vertical: \"timestamp gx gy gz\" a line");
  AddImuOption(*command, options->side);
  AddDepthOptions(*command, options->side);
  AddScaleOptions(*command, options->scale);
  options->view->AddOptions(*command);
  AddRecordingOptions(*command, options->recording);
  command->add_option("--seed", options->seed, "of the random numbers");
  AddCommonOptions(*command, options->common);
  AddImageOptions(*command, options->common);
  AddFollowOption(*command, options->common);
  command->callback([options] { Run(*options); });
}

}  // namespace oaslam::apps
