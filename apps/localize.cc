#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "common.h"
#include "oaslam/error.h"
#include "oaslam/io/camera_file.h"
#include "oaslam/io/map_file.h"
#include "oaslam/io/text.h"
#include "oaslam/io/trajectory_file.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/util/stopwatch.h"
#include "timed_detections.h"

namespace oaslam::apps {
namespace {

struct Options {
  CommonOptions common;
  std::string map, camera, detections, out, gravity, relocalization = "objects";
  bool every_frame = false;
};

struct StampedGravity {
  double timestamp = 0;
  Eigen::Vector3d in_cam = Eigen::Vector3d::Zero();
};

// "timestamp gx gy gz" a line, sorted by time on return.
std::vector<StampedGravity> LoadGravity(const std::string& path) {
  std::vector<StampedGravity> samples;
  const std::string text = ReadTextFile(path);
  int number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const std::string_view content = Trim(line);
    if (content.empty() || content.front() == '#') continue;
    std::vector<double> values;
    for (const std::string_view field : SplitFields(content))
      if (const auto value = ParseNumber(field)) values.push_back(*value);
    const bool valid = values.size() == 4 && SplitFields(content).size() == 4;
    if (!valid || Eigen::Vector3d(values[1], values[2], values[3]).norm() == 0)
      throw InputError(fmt::format("{}:{}: expected \"timestamp gx gy gz\", not all zero", path, number));
    samples.push_back({values[0], {values[1], values[2], values[3]}});
  }
  std::ranges::stable_sort(samples, {}, &StampedGravity::timestamp);
  return samples;
}

std::optional<Eigen::Vector3d> GravityAt(const std::vector<StampedGravity>& samples, double timestamp) {
  constexpr double kMaxTimeDifference = 0.020;  // seconds
  const auto nearest =
      std::ranges::min_element(samples, {}, [&](const StampedGravity& s) { return std::abs(s.timestamp - timestamp); });
  if (nearest == samples.end() || std::abs(nearest->timestamp - timestamp) > kMaxTimeDifference) return std::nullopt;
  return nearest->in_cam;
}

// One line of frames.csv, poses.txt and candidates.txt each.
struct Answer {
  int index = 0;
  double timestamp = 0;
  std::vector<ObjectPoseCandidate> candidates;
  double ms = 0;
};

std::vector<Answer> LocalizeByDetections(const Options& options, const Map& map) {
  const SlamConfig config = LoadConfiguration(options.common);
  const Camera camera = LoadCamera(options.camera, {0, 0});
  const auto images = SelectTimedDetections(LoadDetections(options.detections), options.detections, options.common);
  const auto gravity = options.gravity.empty() ? std::vector<StampedGravity>() : LoadGravity(options.gravity);
  ProgressBar progress(static_cast<int>(images.size()), options.common.quiet);
  std::vector<Answer> answers;
  for (const TimedDetections& image : images) {
    const std::vector<ObjectDetection> detections = IdealDetections(camera, image.detections);
    // Seeded per image, so that its answer does not depend on the images before.
    Rng rng(static_cast<uint64_t>(config.runner.seed) + static_cast<uint64_t>(image.index));
    const auto gravity_in_cam = GravityAt(gravity, image.timestamp);
    const Stopwatch watch;
    Answer answer{image.index, image.timestamp, {}, 0};
    answer.candidates = RelocalizeByObjects(detections, camera, map, config.relocalization, gravity_in_cam, rng);
    answer.ms = watch.WallMs();
    answers.push_back(std::move(answer));
    progress.Update(static_cast<int>(answers.size()), "localizing");
  }
  progress.Finish();
  return answers;
}

void WriteAnswers(const Options& options, const std::vector<Answer>& answers) {
  const std::filesystem::path out(options.out);
  std::vector<StampedPose> poses;
  std::vector<ScoredPose> candidates;
  std::string csv = "frame,timestamp,status,confidence,inlier_points,matched_objects,sigma_position,ms_features,ms\n";
  for (const Answer& answer : answers) {
    for (const ObjectPoseCandidate& c : answer.candidates)
      candidates.push_back({{answer.timestamp, c.cam_from_world.Inverse()}, c.score});
    const ObjectPoseCandidate* best = answer.candidates.empty() ? nullptr : &answer.candidates.front();
    const bool accepted = best && best->accepted;
    if (accepted) poses.push_back({answer.timestamp, best->cam_from_world.Inverse()});
    const double confidence = best ? std::clamp(best->score / 100, 0.0, 1.0) : 0;
    csv += fmt::format("{},{:.6f},{},{:.4f},0,{},{:.6g},0,{:.3f}\n", answer.index, answer.timestamp,
                       accepted ? "objects" : "failed", confidence, best ? best->matched.size() : 0,
                       best ? best->sigma_position : 0, answer.ms);
  }
  SaveTrajectory((out / "poses.txt").string(), poses);
  SaveScoredPoses((out / "candidates.txt").string(), candidates);
  WriteTextFile((out / "frames.csv").string(), csv);
  if (!options.common.quiet) fmt::print("{} of {} images localized by objects\n", poses.size(), answers.size());
}

void Localize(const Options& options) {
  const SavedMap saved = LoadMap(options.map);
  EnsureOutputFolder(options.out);
  WriteAnswers(options, LocalizeByDetections(options, saved.map));
}

}  // namespace

void AddLocalizeCommand(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("localize", "Find images in a saved map, by their detected objects");
  command->add_option("--map", options->map, "Map file")->required()->type_name("FILE")->check(CLI::ExistingFile);
  command->add_option("--camera", options->camera, "Calibration")->required()->type_name("CAM");
  command->add_option("--detections", options->detections, "Detections; names that are numbers are time stamps")
      ->required()
      ->type_name("JSON")
      ->check(CLI::ExistingFile);
  command->add_option("--out", options->out, "Output folder")->required()->type_name("DIR");
  command->add_option("--relocalization", options->relocalization, "What to find images by")
      ->check(CLI::IsMember({"objects"}));
  command->add_flag("--every-frame", options->every_frame, "Find each image by itself (always so without images)");
  command->add_option("--gravity", options->gravity, "Gravity in the camera's frame: \"timestamp gx gy gz\" a line")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  AddCommonOptions(*command, options->common);
  command->callback([options] { Localize(*options); });
}

}  // namespace oaslam::apps
