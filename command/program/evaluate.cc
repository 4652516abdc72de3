#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "common.h"
#include "dataset_choice.h"
#include "oaslam/evaluation/object_metrics.h"
#include "oaslam/evaluation/plots.h"
#include "oaslam/evaluation/relocalization_metrics.h"
#include "oaslam/evaluation/trajectory_metrics.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "recording_choice.h"

namespace oaslam::apps {
namespace {

namespace fs = std::filesystem;

struct EvaluateOptions {
  CommonOptions common;
  std::string estimate, groundtruth, align = "sim3", plot, recording, images;
  std::vector<std::string> groundtruths;  // of the recordings of a map
  std::vector<std::string> poses;
  std::vector<std::string> map_trajectories;
  std::string map_groundtruth, frames, hypotheses;
  std::string objects, truth;
};

AlignMode ParseAlign(const std::string& word) {
  return word == "sim3" ? AlignMode::kSim3 : word == "se3" ? AlignMode::kSe3 : AlignMode::kNone;
}

void AddAlign(CLI::App& app, EvaluateOptions& o) {
  app.add_option("--align", o.align, "How the estimate is fitted to the ground truth first")
      ->check(CLI::IsMember({"sim3", "se3", "none"}))
      ->capture_default_str();
}

void PrintRow(const char* name, const ErrorStatistics& s, const char* unit) {
  fmt::print("{:<26} {:>10.5f} {:>10.5f} {:>10.5f} {:>10.5f} {:>7}  {}\n", name, s.rmse, s.mean,
             s.median, s.max, s.count, unit);
}

// The name of a curve: "foo" for results/foo/trajectory.txt.
std::string CurveName(const std::string& path) {
  const fs::path file = fs::absolute(path);
  const bool is_ours = file.filename() == "poses.txt" || file.filename() == "trajectory.txt";
  return is_ours ? file.parent_path().filename().string() : file.stem().string();
}

void PrintConsistency(const std::string& frames, const TrajectoryReport& report) {
  std::vector<std::pair<double, double>> sigmas;
  for (const auto& row : LoadColumns(frames, {"timestamp", "sigma_position"}))
    sigmas.emplace_back(row[0], row[1]);
  const ConsistencyReport consistency = EvaluateConsistency(report, sigmas);
  fmt::print(
      "consistency: median squared error over its variance {:.2f} (0.8 where sigmas are right), "
      "beyond three sigmas {:.1f} % of {} poses\n",
      consistency.median, 100 * consistency.share_beyond, consistency.count);
}

struct Estimate {
  std::string name;  // in messages
  std::vector<StampedPose> poses;
  std::string images;  // from which it was made; empty: not known
};

// A path of images, where there are some still; a map does not follow them.
std::string IfThere(const std::string& images) {
  std::error_code error;
  return fs::exists(images, error) ? images : "";
}

// The images of a run, as the summary.json beside its trajectory names them; empty where there is
// none, or they are not there any more.
std::string ImagesBeside(const std::string& trajectory) {
  const fs::path summary = fs::path(trajectory).parent_path() / "summary.json";
  std::error_code error;
  if (!fs::exists(summary, error)) return "";
  const auto root = nlohmann::json::parse(ReadTextFile(summary.string()), nullptr, false);
  if (!root.is_object() || !root.contains("images") || !root["images"].is_string()) return "";
  return IfThere(root["images"].get<std::string>());
}

void Evaluate(const EvaluateOptions& o, const Estimate& estimated,
              const std::string& groundtruth_path) {
  const std::vector<StampedPose>& estimate = estimated.poses;
  const auto groundtruth =
      LoadGroundtruth(groundtruth_path, o.common, o.images.empty() ? estimated.images : o.images);
  const TrajectoryReport report = EvaluateTrajectory(groundtruth, estimate, ParseAlign(o.align));
  if (!report.success) throw BadInput("{}: {}", estimated.name, report.why_not);
  const double scale = report.reference_from_estimate.scale;
  fmt::print("{:<26} {:>10} {:>10} {:>10} {:>10} {:>7}\n", "", "rmse", "mean", "median", "max",
             "count");
  PrintRow("ATE position", report.position, "m");
  PrintRow("ATE rotation", report.rotation_deg, "deg");
  for (const double interval : {0.0, 1.0}) {
    const RelativeReport relative = EvaluateRelative(groundtruth, estimate, scale, interval);
    PrintRow(interval == 0 ? "RPE translation, a frame" : "RPE translation, a second",
             relative.translation, "m");
    PrintRow(interval == 0 ? "RPE rotation, a frame" : "RPE rotation, a second",
             relative.rotation_deg, "deg");
  }
  fmt::print("poses {} of {} with ground truth, align {}, scale {:.6f}\n", report.pairs,
             estimate.size(), o.align, scale);
  if (!o.frames.empty()) PrintConsistency(o.frames, report);
  if (o.plot.empty()) return;
  std::vector<StampedPose> shown;  // only the time span of the estimate
  for (const StampedPose& pose : groundtruth)
    if (pose.timestamp >= estimate.front().timestamp - 0.05 &&
        pose.timestamp <= estimate.back().timestamp + 0.05)
      shown.push_back(pose);
  SaveTrajectoryPlot(
      o.plot, shown, Aligned(estimate, report.reference_from_estimate),
      fmt::format("{}: ATE {:.2f} cm over {} poses", fs::path(o.estimate).filename().string(),
                  100 * report.position.rmse, report.pairs));
}

void WarnOfRepeatedTimes(const std::string& path, const std::vector<StampedPose>& poses) {
  size_t repeated = 0;
  for (size_t i = 1; i < poses.size(); ++i)
    repeated += poses[i].timestamp == poses[i - 1].timestamp ? 1 : 0;
  if (repeated > 0)
    Log(LogLevel::kWarning,
        "{}: {} times are there twice: of two recordings? They are mixed up then; oaslam export "
        "--recording takes one of a map",
        path, repeated);
}

// The trajectory of a file, or those of each recording of a map.
std::vector<Estimate> LoadEstimates(const EvaluateOptions& o) {
  if (!IsMapFile(o.estimate)) {
    if (!o.recording.empty()) throw InputError(o.estimate + ": --recording is for map files");
    std::vector<StampedPose> poses = LoadTrajectory(o.estimate);
    WarnOfRepeatedTimes(o.estimate, poses);
    return {{o.estimate, std::move(poses), ImagesBeside(o.estimate)}};
  }
  const SavedMap saved = LoadMap(o.estimate);
  const auto trajectories = FinalTrajectories(saved);
  std::vector<Estimate> estimates;
  for (size_t i = 0; i < trajectories.size(); ++i)
    if (o.recording.empty() || FindRecording(saved.recordings, o.recording) == i)
      estimates.push_back(
          {fmt::format("{}, recording {}", o.estimate, Describe(saved.recordings, i)),
           trajectories[i],
           i < saved.recordings.size() ? IfThere(saved.recordings[i].images) : ""});
  return estimates;
}

void EvaluateTrajectoryCommand(const EvaluateOptions& o) {
  const std::vector<Estimate> estimates = LoadEstimates(o);
  if (o.groundtruths.size() != estimates.size())
    throw BadInput(
        "{}: has {} recordings, and {} ground truths are given; allowed: one for each, or "
        "--recording",
        o.estimate, estimates.size(), o.groundtruths.size());
  if (estimates.size() > 1 && !(o.plot + o.frames).empty())
    throw InputError("--plot, --frames: are for one recording (--recording)");
  for (size_t i = 0; i < estimates.size(); ++i) {
    if (estimates.size() > 1) fmt::print("{}{}\n", i == 0 ? "" : "\n", estimates[i].name);
    Evaluate(o, estimates[i], o.groundtruths[i]);
  }
}

// The alignment of the map in whose frame `map_trajectory` is, to the frame of the ground truth.
Alignment AlignMap(const EvaluateOptions& o, const std::string& map_trajectory) {
  const std::string& groundtruth = o.map_groundtruth.empty() ? o.groundtruth : o.map_groundtruth;
  const TrajectoryReport report =
      EvaluateTrajectory(LoadGroundtruth(groundtruth, o.common, ImagesBeside(map_trajectory)),
                         LoadTrajectory(map_trajectory), ParseAlign(o.align));
  if (!report.success) throw BadInput("{}: {}", map_trajectory, report.why_not);
  return report.reference_from_estimate;
}

// Time stamps of all frames that were processed: as given, or from frames.csv beside the poses.
std::vector<double> FrameTimes(const EvaluateOptions& o, const std::string& poses_path,
                               const std::vector<StampedPose>& poses) {
  if (!o.frames.empty()) return LoadFrameTimes(o.frames);
  const fs::path beside = fs::path(poses_path).parent_path() / "frames.csv";
  if (fs::exists(beside)) return LoadFrameTimes(beside.string());
  Log(LogLevel::kWarning,
      "{}: no frames.csv beside it and no --frames: shares refer to its poses only", poses_path);
  std::vector<double> times;
  for (const StampedPose& pose : poses) times.push_back(pose.timestamp);
  return times;
}

void PrintRelocalization(const RelocalizationErrors& errors) {
  const RelocalizationFigures figures = Summarize(errors);
  fmt::print("{}: {} frames, {:.1f} % answered, {:.1f} % false, median {:.1f} cm {:.2f} deg\n",
             errors.name, errors.frames, 100 * figures.accepted, 100 * figures.false_share,
             100 * figures.median_position, figures.median_rotation_deg);
  const auto row = [](const char* name, const auto& values) {
    fmt::print("  {:<12}", name);
    for (const double v : values) fmt::print(" {:>7.1f} %", 100 * v);
    fmt::print("\n");
  };
  fmt::print("  {:<12}", "within");
  for (const double d : kRecallDistances) fmt::print(" {:>6.0f} cm", 100 * d);
  fmt::print("\n");
  row("recall", figures.recall);
  row("precision", figures.precision);
}

// Reads candidates.txt and frames.csv of `localize`, beside poses.txt.
std::vector<HypothesisError> HypothesesBeside(const std::string& poses_path,
                                              const std::vector<StampedPose>& groundtruth,
                                              const Alignment& alignment) {
  const fs::path folder = fs::path(poses_path).parent_path();
  std::vector<std::pair<double, double>> confidences;
  for (const auto& row : LoadColumns((folder / "frames.csv").string(), {"timestamp", "confidence"}))
    confidences.emplace_back(row[0], row[1]);
  return CompareHypotheses(groundtruth, LoadScoredPoses((folder / "candidates.txt").string()),
                           confidences, alignment);
}

// One for each --poses.
std::vector<Alignment> AlignMaps(const EvaluateOptions& o) {
  if (o.map_trajectories.size() != 1 && o.map_trajectories.size() != o.poses.size())
    throw BadInput("--map-trajectory: given {} times for {} --poses; allowed: once, or once each",
                   o.map_trajectories.size(), o.poses.size());
  std::vector<Alignment> alignments;
  for (const std::string& path : o.map_trajectories) alignments.push_back(AlignMap(o, path));
  alignments.resize(o.poses.size(), alignments.front());
  return alignments;
}

void EvaluateRelocalizationCommand(const EvaluateOptions& o) {
  const std::vector<Alignment> alignments = AlignMaps(o);
  const auto groundtruth = LoadGroundtruth(
      o.groundtruth, o.common, o.images.empty() ? ImagesBeside(o.poses.front()) : o.images);
  std::vector<RelocalizationErrors> curves;
  for (size_t i = 0; i < o.poses.size(); ++i) {
    const auto poses = LoadTrajectory(o.poses[i]);
    curves.push_back(
        CompareRelocalization(groundtruth, poses, FrameTimes(o, o.poses[i], poses), alignments[i]));
    curves.back().name = CurveName(o.poses[i]);
  }
  for (const RelocalizationErrors& curve : curves) PrintRelocalization(curve);
  if (!o.hypotheses.empty())
    SaveHypothesisErrors(o.hypotheses,
                         HypothesesBeside(o.poses.front(), groundtruth, alignments.front()));
  if (!o.plot.empty()) SaveRecallPlot(o.plot, curves, "Frames localized within a distance");
}

void EvaluateObjectsCommand(const EvaluateOptions& o) {
  const auto mapped = LoadObjects(o.objects), truth = LoadTrueObjects(o.truth);
  const ObjectReport report =
      EvaluateObjects(mapped, truth, AlignMap(o, o.map_trajectories.front()));
  fmt::print("{} mapped, {} true, {} matched: recall {:.3f}, precision {:.3f}\n", mapped.size(),
             truth.size(), report.matches.size(), report.recall, report.precision);
  fmt::print("median centre error {:.3f} of the longest half axis, median size error {:.1f} %\n",
             report.median_centre, 100 * (std::exp(report.median_log_size) - 1));
  std::vector<bool> found(truth.size()), right(mapped.size());
  for (const ObjectMatch& match : report.matches) found[match.truth] = right[match.mapped] = true;
  for (size_t i = 0; i < truth.size(); ++i)
    if (!found[i]) fmt::print("missed: {}\n", truth[i].name);
  for (size_t i = 0; i < mapped.size(); ++i)
    if (!right[i]) fmt::print("wrong: {}\n", mapped[i].name);
}

}  // namespace

void AddEvaluateCommand(CLI::App& app) {
  auto options = std::make_shared<EvaluateOptions>();
  EvaluateOptions& o = *options;
  CLI::App* evaluate = app.add_subcommand("evaluate", "Compare results with ground truth");
  evaluate->require_subcommand(1);

  CLI::App* trajectory = evaluate->add_subcommand(
      "trajectory", "Absolute and relative error of a trajectory (TUM format)");
  trajectory->add_option("estimate", o.estimate, "Trajectory, or a map file")->required();
  trajectory
      ->add_option("groundtruth", o.groundtruths,
                   "Ground truth, or the folder of a dataset that has it; of a map of several "
                   "recordings one for each")
      ->required();
  AddRecordingOption(*trajectory, o.recording);
  trajectory->add_option("--plot", o.plot, "Draw both into this SVG");
  trajectory->add_option("--frames", o.frames,
                         "frames.csv of the run: also compares the errors with their stated "
                         "standard deviations, which are those of trajectory_live.txt");
  trajectory->callback([options] { EvaluateTrajectoryCommand(*options); });

  CLI::App* relocalization =
      evaluate->add_subcommand("relocalization", "Recall and precision of localized poses");
  AddRepeatable(*relocalization, "--poses", o.poses,
                "poses.txt of localize; may be repeated, to compare")
      ->required();
  relocalization->add_option("--map-groundtruth", o.map_groundtruth,
                             "Ground truth of the mapping run, where it is another sequence than "
                             "the query's; default: --groundtruth");
  relocalization->add_option("--frames", o.frames,
                             "All frames that were processed (frames.csv or a list with time "
                             "stamps); default: frames.csv beside the poses");
  relocalization->add_option("--hypotheses", o.hypotheses,
                             "Write confidence and error of each frame's best hypothesis into this "
                             "CSV (of the first --poses)");
  relocalization->add_option("--plot", o.plot,
                             "Draw the share of frames against the error into this SVG");
  relocalization->callback([options] { EvaluateRelocalizationCommand(*options); });

  CLI::App* objects = evaluate->add_subcommand("objects", "Objects of a map against true ones");
  objects->add_option("objects", o.objects, "objects.json of a run")->required();
  objects->add_option("--truth", o.truth, "True objects (JSON)")->required();
  objects->callback([options] { EvaluateObjectsCommand(*options); });

  const std::string map_trajectory =
      "keyframes.txt or trajectory.txt of the mapping run: takes the map to the ground truth";
  AddRepeatable(*relocalization, "--map-trajectory", o.map_trajectories,
                map_trajectory + "; may be repeated, where each --poses has a map of its own")
      ->required();
  objects->add_option("--map-trajectory", o.map_trajectories, map_trajectory)
      ->expected(1)
      ->required();
  for (CLI::App* command : {relocalization, objects})
    command->add_option("--groundtruth", o.groundtruth, "Ground truth (TUM format)")->required();
  for (CLI::App* command : {trajectory, relocalization})
    command->add_option("--images", o.images,
                        "The images of the estimate, where the ground truth names its images and "
                        "has no times (COLMAP, Nerfstudio); by default those that the map or the "
                        "folder of the run names");
  for (CLI::App* command : {trajectory, relocalization, objects}) {
    AddAlign(*command, o);
    command->add_option(
        "--fps", o.common.fps,
        "Frames a second that the run was given, where a folder without times is the ground truth");
  }
  for (CLI::App* command : {trajectory, relocalization, objects})
    AddQuietOption(*command, o.common);
}

}  // namespace oaslam::apps
