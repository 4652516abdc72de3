#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "beside.h"
#include "camera_choice.h"
#include "commands.h"
#include "common.h"
#include "dataset_choice.h"
#include "detection_choice.h"
#include "failures.h"
#include "frame_inputs.h"
#include "gravity_file.h"
#include "mask_choice.h"
#include "oaslam/camera_file.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/focal_metadata.h"
#include "oaslam/map_localizer.h"
#include "oaslam/pictures/map_results.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/bad_input.h"
#include "recorded_inputs.h"
#include "recording.h"
#include "timed_detections.h"

namespace oaslam::apps {
namespace {

struct LocalizeOptions {
  CommonOptions common;
  PlainForm plain;
  DetectorSettings detector;
  SideFiles side;
  RecordingSettings recording;
  std::string map, images, camera, out, relocalization = "points+objects", mask;
  bool every_frame = false;
  int forget_every = 0;  // images; 0: never
  int submap = 0;
};

// Writes poses.txt, candidates.txt and frames.csv (docs/formats.md).
class LocalizeResults {
 public:
  explicit LocalizeResults(const std::string& folder) : folder_(folder) {}

  // `is_followed`: the pose follows from those before it, by the camera's motion.
  void Add(int index, double timestamp, const RelocalizationResult& r, bool is_followed = false) {
    if (!frames_.is_open()) OpenFrames();
    frames_ << fmt::format("{},{:.6f},{},{:.4f},{},{},{:.6g},{:.3f},{:.3f},{:.3f},{:.3f},{:.2f}\n",
                           index, timestamp, is_followed ? "followed" : ToString(r.evidence),
                           r.confidence, r.inlier_points, r.matched_objects, r.sigma_position,
                           r.ms_features, r.ms, r.object_score, r.object_margin,
                           r.camera ? r.camera->fx : focal_length_);
    for (const auto& c : r.candidates)
      candidates_.push_back({{timestamp, c.world_from_cam}, c.score});
    if (r.world_from_cam) poses_.push_back({timestamp, *r.world_from_cam});
    ++count_;
    if (is_followed)
      ++followed_;
    else
      ++by_evidence_[static_cast<size_t>(r.evidence)];
  }

  // The focal length, in pixels, of images for which it is not estimated individually.
  void SetFocalLength(double focal_length) { focal_length_ = focal_length; }
  void SetPresence(std::vector<ObjectPresence> presence) { presence_ = std::move(presence); }

  int count() const { return count_; }  // images so far
  bool has_poses() const { return !poses_.empty(); }

  void Finish(const SavedMap& saved, Failures& failures) {
    failures.Try([&] { FinishFrames(); });
    failures.Try([&] { SavePresence(saved); });
    failures.Try([&] { SaveTrajectory(folder_ + "/poses.txt", poses_); });
    failures.Try([&] { SaveScoredPoses(folder_ + "/candidates.txt", candidates_); });
    failures.Try([&] {
      SaveMapSvg(folder_ + "/map.svg", {.map = &saved.map,
                                        .localized = poses_,
                                        .names = saved.class_names,
                                        .title = "oaslam localize"});
    });
  }

  void Print() const {
    fmt::print(
        "{} of {} images localized ({} by points, {} by points from objects, {} by objects alone, "
        "{} followed from these); results in {}\n",
        poses_.size(), count_, by_evidence_[static_cast<size_t>(PoseEvidence::kPoints)],
        by_evidence_[static_cast<size_t>(PoseEvidence::kPointsAndObjects)],
        by_evidence_[static_cast<size_t>(PoseEvidence::kObjects)], followed_, folder_);
  }

 private:
  // Opened with the first image, so that refused input leaves no file behind.
  void OpenFrames() {
    frames_.open(folder_ + "/frames.csv");
    if (!frames_) throw BadInput("{}/frames.csv: cannot be written", folder_);
    frames_ << "frame,timestamp,status,confidence,inlier_points,matched_objects,sigma_position,ms_"
               "features,ms,object_score,object_margin,focal_length\n";
  }
  void FinishFrames() {
    if (!frames_.is_open()) OpenFrames();
    frames_.close();
    if (!frames_) throw BadInput("{}/frames.csv: cannot be written whole", folder_);
  }
  void SavePresence(const SavedMap& saved) const {
    nlohmann::ordered_json objects = nlohmann::ordered_json::array();
    for (const ObjectPresence& p : presence_) {
      const std::string category = NameOf(saved.class_names, p.category_id);
      objects.push_back({{"id", p.id.value},
                         {"category_id", p.category_id},
                         {"category", category},
                         {"expected", p.expected},
                         {"seen", p.seen},
                         {"missing", p.is_missing}});
      if (p.is_missing)
        spdlog::warn(
            "object {} ({}): moved or gone, seen in its place in {} of {} images that should show "
            "it",
            p.id.value, category, p.seen, p.expected);
    }
    WriteTextFile(folder_ + "/presence.json", JsonText(objects, 1) + "\n");
  }

  std::string folder_;
  std::vector<ObjectPresence> presence_;
  std::ofstream frames_;
  std::vector<StampedPose> poses_;
  std::vector<ScoredPose> candidates_;
  std::array<int, 4> by_evidence_{};  // without those of followed_
  int followed_ = 0;
  double focal_length_ = 0;
  int count_ = 0;
};

bool IsFollowed(const TrackingResult& t) {
  return t.state == TrackingState::kOdometry || t.source == PoseSource::kRegistration;
}

RelocalizationResult FromTracking(const TrackingResult& t) {
  RelocalizationResult r;
  r.ms_features = t.ms_features;
  r.ms = t.ms_track;
  r.inlier_points = t.inliers.value_or(0);
  r.matched_objects = t.objects;
  r.world = t.world;
  r.world_from_cam = t.PoseIn(t.world);
  if (!r.world_from_cam) return r;
  r.evidence = t.state == TrackingState::kObjects ? PoseEvidence::kObjects : PoseEvidence::kPoints;
  r.confidence = t.confidence;
  r.candidates.push_back({*r.world_from_cam, static_cast<double>(r.inlier_points)});
  return r;
}

// The class relations of a class file replace those of the map.
void UseClassFile(const CommonOptions& options, Slam& slam) {
  if (!options.classes.empty()) slam.SetClassRelations(LoadClasses(options).relations);
}

MapSnapshot MapOfOptions(const LocalizeOptions& options) {
  return MapSnapshot::Load(options.map, options.submap);
}

// Makes the camera lost, so that the first image is relocalized.
void BeginInMap(const LocalizeOptions& options, Slam& slam) {
  slam.Load(options.map, options.submap);
  UseClassFile(options.common, slam);
}

// Whether to forget the earlier images before the next one is relocalized.
bool MustForget(const LocalizeOptions& options, int done) {
  return options.forget_every > 0 && done > 0 && done % options.forget_every == 0;
}

// Finds images that the camera of the others did not take: of another size or lens.
class OtherImages {
 public:
  OtherImages(const LocalizeOptions& options, const SlamConfig& config)
      : options_(options), config_(config) {}

  RelocalizationResult Find(const FrameInput& frame, RelocalizationMode mode) {
    const RelocalizationResult found = localizer().Relocalize(frame.input, {.mode = mode});
    return found.world_from_cam ? found : ByMetadata(frame, mode).value_or(found);
  }
  // By the focal length in the image's metadata; nothing where it has none, or that does not help.
  std::optional<RelocalizationResult> ByMetadata(const FrameInput& frame, RelocalizationMode mode) {
    const auto mm = frame.path.empty() ? std::nullopt : FocalLength35mm(frame.path);
    if (!mm) return std::nullopt;
    const cv::Size size = frame.input.image.size();
    Camera camera{.width = size.width, .height = size.height};
    camera.fx = camera.fy = *mm * std::hypot(size.width, size.height) / kFrameDiagonal35mm;
    camera.cx = 0.5 * (size.width - 1), camera.cy = 0.5 * (size.height - 1);
    RelocalizationResult found =
        localizer().Relocalize(frame.input, {.mode = mode, .camera = camera});
    if (!found.world_from_cam) return std::nullopt;
    found.camera = camera;
    return found;
  }

 private:
  const MapLocalizer& localizer() {
    if (!localizer_) localizer_.emplace(MapOfOptions(options_), config_);
    return *localizer_;
  }

  const LocalizeOptions& options_;
  const SlamConfig& config_;
  // Once it is needed: it loads the map again, since few folders hold such images.
  std::optional<MapLocalizer> localizer_;
};

FrameInputs::Sources SourcesOf(const LocalizeOptions& options, const std::optional<Camera>& known) {
  return {.images = options.images,
          .camera = options.camera,
          .detector = options.detector,
          .live = false,
          .for_display = options.recording.IsAskedFor(),
          .in_map = true,
          .known_camera = known};
}

SideInputs SideInputsOf(const LocalizeOptions& options) {
  return {options.side, options.camera, options.detector, options.common};
}

// Estimates the one camera of a source: relocalizes images until some are found, and takes the
// camera of the one with the most points.
std::optional<Camera> CameraFromMap(const LocalizeOptions& options, const cv::Mat& mask,
                                    const SlamConfig& config) {
  // Images found, of which the best is taken; images looked at, seven seconds of a video.
  constexpr int kEnough = 5, kMaxImages = 200;
  LocalizeOptions without_imu = options;
  without_imu.side.imu.clear();
  without_imu.side.recorded_imu.reset();
  FrameInputs inputs(SourcesOf(options, std::nullopt), SideInputsOf(without_imu), options.common);
  Slam slam(config, inputs.camera());
  UseMask(options.mask, mask, slam, inputs.camera());
  slam.Load(options.map, options.submap);
  RelocalizationResult best;
  int found = 0;
  for (int i = 0; i < kMaxImages && found < kEnough; ++i) {
    const std::optional<FrameInput> frame = inputs.Next();
    if (!frame) break;
    RelocalizationResult r = slam.Relocalize(
        frame->input,
        {.mode = RelocalizationModeOf(options.relocalization), .unknown_camera = true});
    if (!r.camera) continue;
    ++found;
    if (!best.camera || r.inlier_points > best.inlier_points) best = std::move(r);
  }
  if (!best.camera) {
    spdlog::warn(
        "camera: none of the first images is found in the map, whatever the focal length; goes on "
        "with a guess: {:.1f} px",
        inputs.camera().fx);
    return inputs.camera();
  }
  const bool is_of_map = best.focal_sigma_px <= 0;
  spdlog::info("camera: focal length {:.1f} px, {}", best.camera->fx,
               is_of_map ? "that of the map's camera" : "found by the map");
  return best.camera;
}

void LocalizeImages(const LocalizeOptions& options, const SlamConfig& config,
                    LocalizeResults& results) {
  const bool is_auto = IsAutoCamera(options.camera) && !options.side.recorded_camera;
  Recording recording(options.recording, options.images);
  SideInputs side = SideInputsOf(options);
  const cv::Mat mask = MaskFor(options.mask, options.camera, options.images, options.common);
  FrameInputs::Sources sources =
      SourcesOf(options, is_auto && !options.every_frame ? CameraFromMap(options, mask, config)
                                                         : std::nullopt);
  sources.any_size = true;
  FrameInputs inputs(sources, std::move(side), options.common);
  OtherImages others(options, config);
  results.SetFocalLength(inputs.camera().fx);
  if (is_auto && options.every_frame && inputs.has_depths())
    spdlog::warn("--depth: not used, since the camera is not known; --camera gives it");
  Slam slam(config, inputs.camera());
  UseMask(options.mask, mask, slam, inputs.camera());
  slam.SetImu(inputs.cam_from_imu());
  BeginInMap(options, slam);
  slam.SetMapping(false);
  const RelocalizationMode mode = RelocalizationModeOf(options.relocalization);
  slam.SetRelocalizationMode(mode);
  recording.Begin(slam, inputs.camera());
  ProgressBar progress(inputs.size(), options.common.quiet);
  int done = 0;
  InstallInterruptHandler();
  Failures failures;
  failures.Try([&] {
    while (const std::optional<FrameInput> frame = Interrupted() ? std::nullopt : inputs.Next()) {
      if (MustForget(options, done)) BeginInMap(options, slam);
      RelocalizationResult result;
      bool is_followed = false;
      const Camera& camera = inputs.camera();
      if (frame->input.image.size() != cv::Size(camera.width, camera.height)) {
        result = others.Find(*frame, mode);
      } else if (options.every_frame) {
        result = slam.Relocalize(frame->input, {.mode = mode, .unknown_camera = is_auto});
        if (is_auto && !result.world_from_cam)
          result = others.ByMetadata(*frame, mode).value_or(result);
        recording.Add(*frame, result);
      } else {
        const TrackingResult tracked = slam.Process(frame->input);
        inputs.SetState(tracked.state);
        inputs.SetVertical(VerticalIn(slam, *frame, tracked));
        recording.Add(slam, *frame, tracked);
        result = FromTracking(tracked);
        is_followed = IsFollowed(tracked);
      }
      results.Add(frame->index, frame->input.timestamp, result, is_followed);
      progress.Update(++done, ToString(result.evidence));
    }
  });
  progress.Finish();
  inputs.ReportSensors(slam.Imu());
  results.SetPresence(slam.Presence());
  failures.Try([&] { recording.Finish(); });
  failures.Throw();
}

void LocalizeDetections(const LocalizeOptions& options, const SlamConfig& config,
                        LocalizeResults& results) {
  if (options.side.detections.empty())
    throw InputError("localize: neither --images nor --detections given");
  if (options.relocalization != "objects")
    throw BadInput("localize: --relocalization {} needs --images; without, only objects",
                   options.relocalization);
  if (IsAutoCamera(options.camera))
    throw InputError("localize: --camera auto needs --images; give a calibration");
  const Camera camera = LoadCamera(options.camera, {0, 0});
  DetectionFile detections = LoadDetectionsFor(options.side.detections, options.common);
  ConvertShares(camera.width, camera.height, detections);
  CheckNames(detections, options.side.detections);
  auto images = SelectTimedDetections(DetectionTable(std::move(detections.images)),
                                      options.side.detections, options.common);
  const cv::Mat mask = MaskFor(options.mask, options.camera, "", options.common);
  for (TimedDetections& image : images) EraseHidden(mask, image.detections);
  GravityTrack gravity =
      options.side.gravity.empty() ? GravityTrack() : GravityTrack::Load(options.side.gravity);
  Slam slam(config, camera);
  BeginInMap(options, slam);
  ProgressBar progress(static_cast<int>(images.size()), options.common.quiet);
  int done = 0;
  InstallInterruptHandler();
  for (const TimedDetections& image : images) {
    if (Interrupted()) break;
    if (MustForget(options, done)) BeginInMap(options, slam);
    const RelocalizationResult result =
        slam.Relocalize({.image = {},
                         .timestamp = image.timestamp,
                         .detections = image.detections,
                         .gravity_in_cam = gravity.At(image.timestamp)},
                        {.mode = RelocalizationMode::kObjects, .follow = !options.every_frame});
    results.Add(image.index, image.timestamp, result);
    progress.Update(++done, ToString(result.evidence));
  }
  progress.Finish();
  gravity.WarnIfUnused();
  results.SetPresence(slam.Presence());
}

// Fills in what the command line leaves out.
LocalizeOptions Complete(LocalizeOptions options) {
  Complete(options.plain, ".localized",
           {options.images, options.side.detections, options.detector, options.out});
  if (options.out.empty()) throw InputError("localize: needs --out");
  return options;
}

void Localize(const LocalizeOptions& given) {
  LocalizeOptions options = Complete(given);
  if (options.recording.IsAskedFor() && options.images.empty())
    throw InputError("localize: --record needs --images");
  if (!options.side.imu.empty() && options.images.empty())
    throw InputError("localize: --imu needs --images");
  const SlamConfig config = LoadConfiguration(options.common);
  TakeDataset(options.images, options.common,
              {&options.camera, options.every_frame ? nullptr : &options.side, nullptr,
               options.side.DepthOfDataset()});
  TakeRecording(
      options.images, options.common,
      {&options.camera, &options.side, given.detector.model.empty() ? &options.detector : nullptr});
  if (options.every_frame) options.side.recorded_imu.reset();
  const SavedMap saved = LoadSubmap(options.map, options.submap);
  const OutputFolder folder(options.out);
  LocalizeResults results(options.out);
  Failures failures;
  failures.Try([&] {
    if (options.images.empty())
      LocalizeDetections(options, config, results);
    else
      LocalizeImages(options, config, results);
  });
  // Nothing is written where the inputs were refused.
  if (!failures.Any() || results.count() > 0) results.Finish(saved, failures);
  failures.Throw();
  if (!options.common.quiet) results.Print();
  if (options.plain.IsUsed() && results.has_poses() && !options.common.quiet)
    fmt::print("to look at it: oaslam view {} --map {}{}\n", options.out, options.map,
               options.submap > 0 ? fmt::format(" --submap {}", options.submap) : "");
  EndIfInterrupted();
}

}  // namespace

void AddLocalizeCommand(CLI::App& app) {
  auto* command =
      app.add_subcommand("localize", "Find images in a saved map, which stays as it is");
  const auto options = std::make_shared<LocalizeOptions>();
  command->add_option("--map", options->map, "map file")->required();
  AddSubmapOption(*command, options->submap);
  auto* images =
      command->add_option("--images", options->images,
                          "folder of a dataset or of images, list file, video, recording "
                          "of ROS (.mcap, .bag, rosbag2), or camera (webcam:0, "
                          "rtsp://...); without: by detections alone");
  AddPlainForm(*command, options->plain, images);
  command->add_option("--camera", options->camera,
                      "calibration file, fov:DEGREES for a guess, or auto (default): that of the "
                      "map, or found by its points");
  auto* detections =
      command->add_option("--detections", options->side.detections,
                          "the boxes of all images: JSON, CSV, or a folder of YOLO's texts");
  AddDetectorOptions(*command, options->detector)->excludes(detections);
  AddDetectEveryOption(*command, options->detector);
  command->add_option("--out", options->out, "folder for the results; by default beside PATH");
  AddRelocalizationOption(*command, options->relocalization, "by what images are found");
  auto* every_frame =
      command->add_flag("--every-frame", options->every_frame,
                        "find each image by itself instead of following the camera");
  command
      ->add_option("--forget-every", options->forget_every,
                   "forget after each N images what they told, to measure what N images tell")
      ->check(CLI::PositiveNumber)
      ->excludes(every_frame);
  command->add_option("--gravity", options->side.gravity,
                      "direction of gravity in the camera's frame: \"timestamp gx gy gz\" a line");
  AddMaskOption(*command, options->mask);
  AddImuOption(*command, options->side)->excludes(every_frame);
  AddDepthOptions(*command, options->side);
  AddRecordingOptions(*command, options->recording);
  AddCommonOptions(*command, options->common);
  AddImageOptions(*command, options->common);
  AddFollowOption(*command, options->common);
  command->callback([options] { Localize(*options); });
}

}  // namespace oaslam::apps
