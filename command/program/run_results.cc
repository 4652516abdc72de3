#include "run_results.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>

#include "failures.h"
#include "oaslam/camera_file.h"
#include "oaslam/evaluation/trajectory_metrics.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/pictures/map_results.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam::apps {
namespace {

double Percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, place);
  return *place;
}

double Rounded(double value, double unit) { return std::round(value / unit) * unit; }

double MeanObjectIou(const Map& map) {
  double sum = 0;
  int count = 0;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    sum += object.mean_iou;
    ++count;
  });
  return count > 0 ? sum / count : 0;
}

// The source of the camera, its intrinsics, and the standard deviation of an
// estimated focal length.
nlohmann::ordered_json CameraSummary(const Camera& camera,
                                     const std::optional<CameraEstimate>& estimate) {
  nlohmann::ordered_json summary;
  summary["source"] = !estimate                 ? (camera.is_guess ? "guess" : "given")
                      : estimate->is_determined ? "images"
                                                : "guess";
  summary["fx"] = camera.fx;
  summary["fy"] = camera.fy;
  summary["cx"] = camera.cx;
  summary["cy"] = camera.cy;
  summary["distortion"] = camera.distortion;
  if (!estimate) return summary;
  if (std::isfinite(estimate->focal_sigma_px))
    summary["sigma_f"] = Rounded(estimate->focal_sigma_px, .01);
  if (estimate->readout_s != 0)
    summary["rolling_shutter_ms"] = Rounded(1000 * estimate->readout_s, .01);
  if (!estimate->is_determined) summary["why_not"] = estimate->why_not;
  return summary;
}

// The focal lengths of a lens that changed; null where it did not.
nlohmann::ordered_json LensSummary(const Camera& camera,
                                   const std::vector<std::pair<int, TrackingResult>>& frames) {
  nlohmann::ordered_json summary;
  double least = 1, most = 1;
  for (const auto& [index, r] : frames) {
    if (r.focal_ratio != 1 && summary.is_null()) summary["changes_from_s"] = r.timestamp;
    least = std::min(least, r.focal_ratio);
    most = std::max(most, r.focal_ratio);
  }
  if (summary.is_null()) return summary;
  summary["least_fx"] = Rounded(least * camera.fx, .1);
  summary["most_fx"] = Rounded(most * camera.fx, .1);
  summary["last_fx"] = Rounded(frames.back().second.focal_ratio * camera.fx, .1);
  return summary;
}

nlohmann::ordered_json SubmapSummary(const Map& map, const std::vector<StampedPose>& trajectory) {
  nlohmann::ordered_json summary;
  summary["images"] = trajectory.size();
  summary["keyframes"] = map.keyframes.size();
  summary["landmarks"] = map.landmarks.size();
  summary["objects"] = map.CountMappedObjects();
  if (!trajectory.empty()) {
    summary["from"] = trajectory.front().timestamp;
    summary["to"] = trajectory.back().timestamp;
  }
  return summary;
}

// Times of earlier recordings, which the map was continued from, would be mixed with those of this
// one.
int FirstFrameOfLast(const SavedMap& saved) {
  return saved.recordings.empty() ? 0 : saved.recordings.back().first_frame;
}

// Empty where nothing was counted.
std::string TextOf(const std::optional<int>& count) { return count ? std::to_string(*count) : ""; }

}  // namespace

RunResults::RunResults(const std::string& folder, const SlamConfig& config)
    : folder_(folder), config_(config) {}

void RunResults::WriteFrames(const std::vector<StampedPose>& trajectory) const {
  std::string csv =
      "frame,timestamp,state,keypoints,matched,inliers,detections,objects,ms_total,ms_features,"
      "ms_track,ms_objects,cpu_ms,filled,depth,submap,confidence,sigma_position,sigma_rotation_"
      "deg,uncertain\n";
  std::map<WorldId, size_t> submaps;  // in the order in which they came
  for (const auto& [index, r] : frames_) {
    const bool filled = !r.HasPose() && std::ranges::binary_search(trajectory, r.timestamp, {},
                                                                   &StampedPose::timestamp);
    csv += fmt::format(
        "{},{:.6f},{},{},{},{},{},{},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f},{:d},{:.6g},{},{:.3f},{:."
        "4g},{:.4g},{:d}\n",
        index, r.timestamp, ToString(r.state), r.keypoints, TextOf(r.matched), TextOf(r.inliers),
        r.detections, r.objects, r.ms_total, r.ms_features, r.ms_track, r.ms_objects, r.cpu_ms,
        filled, r.depth, submaps.try_emplace(r.world, submaps.size()).first->second, r.confidence,
        SigmaOfPosition(r.covariance), SigmaOfRotation(r.covariance) / kDegree, r.is_uncertain);
  }
  WriteTextFile(folder_ + "/frames.csv", csv);
}

std::string RunResults::Uncertain() const {
  constexpr double kGap = 1;  // seconds: what is nearer is one passage
  constexpr size_t kMostNamed = 5;
  std::vector<std::pair<double, double>> passages;
  size_t count = 0, poses = 0;
  for (const auto& [index, r] : frames_) {
    poses += r.HasPose();
    if (!r.HasPose() || !r.is_uncertain) continue;
    ++count;
    if (passages.empty() || r.timestamp - passages.back().second > kGap)
      passages.emplace_back(r.timestamp, r.timestamp);
    passages.back().second = r.timestamp;
  }
  if (count == 0) return "";
  std::string where;
  for (size_t i = 0; i < std::min(kMostNamed, passages.size()); ++i)
    where += fmt::format("{}{:.1f} to {:.1f} s", i > 0 ? ", " : "", passages[i].first,
                         passages[i].second);
  if (passages.size() > kMostNamed)
    where += fmt::format(" and {} more times", passages.size() - kMostNamed);
  return fmt::format("{} of {} poses were uncertain when they were given: {}", count, poses, where);
}

std::string RunResults::Loose() const {
  constexpr double kLeast = 1;  // seconds: less is an image or two in a door
  std::string text;
  for (const LooseStretch& stretch : loose_)
    if (stretch.to_s - stretch.from_s >= kLeast)
      text += fmt::format(
          "{}{:.1f} to {:.1f} s hang by a loose link ({} shared landmarks at {:.1f} s): the scale "
          "may be another there",
          text.empty() ? "" : "; ", stretch.from_s, stretch.to_s, stretch.shared, stretch.link_s);
  return text.empty() ? text
                      : text +
                            "\nto tie them, film the way there once more, slowly, or come to the "
                            "same things from another side";
}

void RunResults::WriteCamera() const {
  const std::string note = !estimate_ ? "as given"
                           : estimate_->is_determined
                               ? Describe(*estimate_) + ", estimated from the images"
                               : "a guess: " + estimate_->why_not;
  WriteTextFile(folder_ + "/camera.yaml", CameraText(camera_, note));
}

void RunResults::Detected(int frame, int detections, std::optional<int> objects) {
  const auto found = std::ranges::find(frames_.rbegin(), frames_.rend(), frame,
                                       [](const auto& entry) { return entry.second.frame; });
  if (found == frames_.rend()) return;
  found->second.detections = detections;
  found->second.objects = objects.value_or(0);
}

void RunResults::Scale(double factor) {
  for (auto& [index, r] : frames_) {
    if (r.world == world_) r.ScaleLengths(factor);
    for (PoseElsewhere& there : r.elsewhere)
      if (there.world == world_) there.ScaleLengths(factor);
  }
}

void RunResults::SetWorld(WorldId world, const std::vector<FormerWorld>& former) {
  world_ = world;
  const auto take = [&](auto& pose) {
    const auto was = std::ranges::find(former, pose.world, &FormerWorld::world);
    if (was == former.end()) return;
    pose.ScaleLengths(was->scale);
    pose.world = world;
  };
  for (auto& [index, r] : frames_) {
    take(r);
    for (PoseElsewhere& there : r.elsewhere) take(there);
  }
}

// Each submap has its own frame and unit.
void RunResults::WriteSubmaps(const std::vector<std::vector<StampedPose>>& submaps) const {
  for (int i = 1; std::filesystem::remove(fmt::format("{}/submap_{}.txt", folder_, i)); ++i)
    ;  // removes files of an earlier run
  for (size_t i = 0; i < submaps.size(); ++i)
    SaveTrajectory(fmt::format("{}/submap_{}.txt", folder_, i + 1), submaps[i]);
}

// An image whose pose was given in another world, but also in the one that is the map's in the end,
// has the latter.
void RunResults::TakePosesInWorld() {
  for (auto& [index, r] : frames_) {
    const auto there = std::ranges::find(r.elsewhere, world_, &PoseElsewhere::world);
    if (r.world != world_ && there != r.elsewhere.end()) r.GoTo(*there);
  }
}

size_t RunResults::Finish(const SavedMap& saved, const std::vector<StampedPose>& trajectory,
                          const std::vector<std::vector<StampedPose>>& submaps,
                          const std::vector<StampedPose>& groundtruth, double wall_s,
                          bool interrupted) {
  TakePosesInWorld();
  std::vector<StampedPose> live;
  std::vector<double> ms;
  for (const auto& [index, r] : frames_) {
    // Poses in the frame of another submap are left out.
    if (const std::optional<Rigid3> pose = r.PoseIn(world_)) live.push_back({r.timestamp, *pose});
    ms.push_back(r.ms_total);
  }
  Failures failures;
  failures.Try([&] { WriteFrames(trajectory); });
  failures.Try([&] { WriteCamera(); });
  failures.Try([&] { WriteSubmaps(submaps); });
  failures.Try([&] { SaveTrajectory(folder_ + "/trajectory.txt", trajectory); });
  failures.Try([&] { SaveTrajectory(folder_ + "/trajectory_live.txt", live); });
  failures.Try([&] {
    SaveTrajectory(folder_ + "/keyframes.txt", KeyframePoses(saved.map, FirstFrameOfLast(saved)));
  });
  failures.Try([&] { SaveObjectsJson(folder_ + "/objects.json", saved.map, saved.class_names); });

  nlohmann::ordered_json summary;
  summary["version"] = OASLAM_VERSION;
  summary["seed"] = config_.runner.seed;
  summary["mode"] = ToString(config_.runner.mode);
  if (!images_.empty()) summary["images"] = images_;
  summary["frames"] = frames_.size();
  summary["tracked"] = trajectory.size();
  summary["keyframes"] = saved.map.keyframes.size();
  summary["landmarks"] = saved.map.landmarks.size();
  summary["objects"] = saved.map.CountMappedObjects();
  summary["submaps"] = nlohmann::ordered_json::array({SubmapSummary(saved.map, trajectory)});
  for (size_t i = 0; i < submaps.size(); ++i)
    summary["submaps"].push_back(SubmapSummary(saved.submaps[i].map, submaps[i]));
  summary["uncertain"] = std::ranges::count_if(frames_, [](const auto& entry) {
    return entry.second.HasPose() && entry.second.is_uncertain;
  });
  loose_ = LooseStretches(saved.map, FirstFrameOfLast(saved));
  summary["loose"] = nlohmann::ordered_json::array();
  for (const LooseStretch& stretch : loose_)
    summary["loose"].push_back({{"from", Rounded(stretch.from_s, .001)},
                                {"to", Rounded(stretch.to_s, .001)},
                                {"shared", stretch.shared},
                                {"link", Rounded(stretch.link_s, .001)}});
  summary["unit"] = saved.map.is_metric ? "metre" : "arbitrary";
  if (const auto& by = saved.map.unit_evidence; by && by->source != UnitSource::kObjects)
    summary["unit_by_sensor"] = {{"sensor", by->source == UnitSource::kImu ? "imu" : "depth"},
                                 {"sigma", Rounded(by->relative_sigma, 1e-4)}};
  else if (const auto& by_objects = saved.map.unit_evidence)
    summary["unit_by_objects"] = {{"sigma", Rounded(by_objects->relative_sigma, 1e-4)},
                                  {"objects", by_objects->objects},
                                  {"classes", by_objects->classes}};
  summary["loops"] = saved.map.loops_closed;
  summary["camera"] = CameraSummary(camera_, estimate_);
  if (const auto lens = LensSummary(camera_, frames_); !lens.is_null()) summary["lens"] = lens;
  summary["ms_median"] = Rounded(Percentile(ms, .5), .01);
  summary["ms_mean"] =
      ms.empty()
          ? 0
          : Rounded(std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size()),
                    .01);
  summary["ms_p95"] = Rounded(Percentile(ms, .95), .01);
  summary["cpu_s"] = Rounded(ProcessCpuSeconds(), .01);
  summary["wall_s"] = Rounded(wall_s, .01);
  summary["peak_rss_mb"] = Rounded(PeakRssMb(), .1);
  if (!ages_s_.empty())
    summary["image_age_s"] = {{"median", Rounded(Percentile(ages_s_, .5), .001)},
                              {"p95", Rounded(Percentile(ages_s_, .95), .001)}};
  if (pace_.images > 0) {
    summary["detector"] = {
        {"images", pace_.images},
        {"ms_mean", Rounded(pace_.busy_ms / pace_.images, .1)},
        {"rate_hz", detector_wall_s_ > 0 ? Rounded(pace_.images / detector_wall_s_, .1) : 0}};
  }
  summary["mean_iou"] = Rounded(MeanObjectIou(saved.map), 1e-4);
  MapPlot plot{.map = &saved.map,
               .trajectory = trajectory,
               .names = saved.class_names,
               .title = "oaslam run"};
  if (!groundtruth.empty()) {
    const TrajectoryReport report = EvaluateTrajectory(groundtruth, trajectory, AlignMode::kSim3);
    if (report.success) {
      summary["ate"] = Rounded(report.position.rmse, 1e-5);
      plot.groundtruth = Aligned(groundtruth, report.reference_from_estimate.Inverse());
    } else {
      spdlog::warn("ground truth: {}", report.why_not);
    }
  }
  if (interrupted) summary["interrupted"] = true;
  failures.Try([&] { SaveMapSvg(folder_ + "/map.svg", plot); });
  failures.Try([&] { WriteTextFile(folder_ + "/summary.json", JsonText(summary, 2) + "\n"); });
  failures.Throw();
  return trajectory.size();
}

}  // namespace oaslam::apps
