#include "metric_scale.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "oaslam/evaluation/trajectory_metrics.h"
#include "oaslam/formats/text.h"
#include "oaslam/objects/scale_estimate.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

double NumberOf(const std::string& option, const std::string& text, const std::string& what) {
  const std::optional<double> value = ParseNumber(text);
  if (!value) throw BadInput("{}: {} \"{}\" is not a number", option, what, text);
  return *value;
}

double ParseMetres(const std::string& option, const std::string& text) {
  const double metres = NumberOf(option, text, "length");
  if (metres < 1e-3 || metres > 1e4)
    throw BadInput("{}: length {} m, allowed: 0.001 to 10000", option, text);
  return metres;
}

// "left=right"; throws without the "=".
std::pair<std::string, std::string> SplitAtEquals(const std::string& option,
                                                  const std::string& text,
                                                  const std::string& form) {
  const size_t equals = text.rfind('=');
  if (equals == std::string::npos) throw BadInput("{} {}: expected {}", option, text, form);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

int CategoryOf(const ClassNames& names, const std::string& name) {
  const auto edits = [&](const auto& entry) { return EditDistance(entry.second, name); };
  const auto nearest = std::ranges::min_element(names, {}, edits);
  if (nearest == names.end()) throw InputError("--scale-object: no classes are known");
  if (nearest->second == name) return nearest->first;
  throw BadInput("--scale-object: class \"{}\" is not known, the nearest is \"{}\"", name,
                 nearest->second);
}

// Extent of an ellipsoid along a unit direction.
double ExtentAlong(const Ellipsoid& e, const Eigen::Vector3d& direction) {
  return 2 * e.half_axes.cwiseProduct(e.rotation.conjugate() * direction).norm();
}

Eigen::Vector3d PositionAt(const std::vector<StampedPose>& trajectory, double timestamp,
                           const std::string& option) {
  constexpr double kMaxGap = 0.1;  // seconds: times are read off a video by hand
  const auto nearest = std::ranges::min_element(
      trajectory, {}, [&](const StampedPose& p) { return std::abs(p.timestamp - timestamp); });
  if (nearest == trajectory.end() || std::abs(nearest->timestamp - timestamp) > kMaxGap)
    throw BadInput("{}: no pose within {} s of time stamp {}", option, kMaxGap, timestamp);
  return nearest->world_from_cam.translation;
}

// By the usual sizes of the objects.
UnitChange ChangeByObjects(const SavedMap& saved) {
  const ScaleEstimate estimate = EstimateScale(saved.map, saved.class_names);
  if (!estimate.success) return {{}, {}, estimate.why_not};
  return {estimate.metres_per_unit,
          UnitEvidence{estimate.relative_sigma, estimate.objects, estimate.classes}};
}

const char* SensorOf(UnitSource source) {
  return source == UnitSource::kImu ? "IMU" : "depth camera";
}

}  // namespace

void AddScaleOptions(CLI::App& app, ScaleSettings& settings) {
  auto* by = app.add_option("--scale", settings.by,
                            "metric scale by the usual sizes of the objects, where those of three "
                            "classes agree (auto), or none")
                 ->check(CLI::IsMember({"auto", "none"}))
                 ->capture_default_str();
  auto* object = app.add_option("--scale-object", settings.object,
                                "metric scale from mapped objects of known height, e.g. cup=0.095")
                     ->type_name("CLASS=HEIGHT_M")
                     ->excludes(by);
  app.add_option("--scale-from", settings.from,
                 "metric scale from --groundtruth (gt), or from the camera's distance between two "
                 "time stamps: T1:T2=METRES")
      ->excludes(object)
      ->excludes(by);
}

MetricScale::MetricScale(const ScaleSettings& settings, const ClassNames& names,
                         const std::vector<StampedPose>& groundtruth)
    : groundtruth_(groundtruth) {
  if (!settings.object.empty()) {
    kind_ = Kind::kObject;
    text_ = "--scale-object " + settings.object;
    const auto [name, height] = SplitAtEquals("--scale-object", settings.object, "CLASS=HEIGHT_M");
    category_id_ = CategoryOf(names, name);
    metres_ = ParseMetres(text_, height);
  } else if (settings.from == "gt") {
    kind_ = Kind::kGroundtruth;
    text_ = "--scale-from gt";
    if (groundtruth.empty()) throw InputError("--scale-from gt: needs --groundtruth");
  } else if (!settings.from.empty()) {
    kind_ = Kind::kDistance;
    text_ = "--scale-from " + settings.from;
    const auto [times, metres] = SplitAtEquals("--scale-from", settings.from, "gt or T1:T2=METRES");
    const size_t colon = times.find(':');
    if (colon == std::string::npos) throw BadInput("{}: expected gt or T1:T2=METRES", text_);
    from_s_ = NumberOf(text_, times.substr(0, colon), "time stamp");
    to_s_ = NumberOf(text_, times.substr(colon + 1), "time stamp");
    metres_ = ParseMetres(text_, metres);
  } else if (settings.by == "auto") {
    kind_ = Kind::kAuto;
  }
}

double MetricScale::FromObjects(const Map& map) const {
  if (!map.up)
    throw InputError(text_ +
                     ": the map's vertical is not known: the camera has turned too little about "
                     "it; --gravity FILE gives it, --scale-from does without");
  std::vector<double> heights;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state == ObjectState::kMapped && object.category_id == category_id_)
      heights.push_back(ExtentAlong(object.ellipsoid, *map.up));
  });
  if (heights.empty()) throw InputError(text_ + ": no object of this class was mapped");
  std::ranges::sort(heights);
  const size_t n = heights.size();
  return metres_ / ((heights[(n - 1) / 2] + heights[n / 2]) / 2);
}

double MetricScale::MetresPerUnit(const Map& map,
                                  const std::vector<StampedPose>& trajectory) const {
  if (kind_ == Kind::kObject) return FromObjects(map);
  if (kind_ == Kind::kGroundtruth) {
    const TrajectoryReport report = EvaluateTrajectory(groundtruth_, trajectory, AlignMode::kSim3);
    if (!report.success) throw InputError(text_ + ": " + report.why_not);
    return report.reference_from_estimate.scale;
  }
  const double units =
      (PositionAt(trajectory, to_s_, text_) - PositionAt(trajectory, from_s_, text_)).norm();
  if (units <= 0) throw InputError(text_ + ": the camera is at the same place at both time stamps");
  return metres_ / units;
}

UnitChange MetricScale::ChangeOf(const SavedMap& saved,
                                 const std::vector<StampedPose>& trajectory) const {
  if (kind_ == Kind::kNone) return {};
  if (kind_ != Kind::kAuto) return {MetresPerUnit(saved.map, trajectory)};
  const auto& evidence = saved.map.unit_evidence;
  const bool is_given =
      saved.map.is_metric && !(evidence && evidence->source == UnitSource::kObjects);
  return is_given ? UnitChange{} : ChangeByObjects(saved);
}

void MetricScale::WarnOfContradiction(const SavedMap& saved,
                                      const std::vector<StampedPose>& trajectory) const {
  if (!saved.map.is_metric || kind_ == Kind::kNone) return;
  ScaleEstimate estimate = EstimateScale(saved.map, saved.class_names);
  std::string of = text_.empty() ? "the unit of the map" : text_;
  const auto& by = saved.map.unit_evidence;
  if (by && by->source != UnitSource::kObjects) {
    of = fmt::format("the metre by the {}", SensorOf(by->source));
    estimate.relative_sigma = std::hypot(estimate.relative_sigma, by->relative_sigma);
  } else if (by) {
    if (groundtruth_.empty()) return;
    const TrajectoryReport report = EvaluateTrajectory(groundtruth_, trajectory, AlignMode::kSim3);
    if (!report.success) return;
    estimate.metres_per_unit = 1 / report.reference_from_estimate.scale;
    of = "the unit of the ground truth";
  }
  if (const std::string contradiction = ContradictionOfUnit(estimate); !contradiction.empty())
    spdlog::warn("{}: {}", of, contradiction);
}

void Apply(const UnitChange& change, SavedMap& saved) {
  if (change.metres_per_unit)
    ScaleToMetres(*change.metres_per_unit, change.by_objects, saved.map, saved.trajectory);
}

std::string DescribeUnit(const Map& map) {
  if (!map.is_metric) return "arbitrary";
  if (!map.unit_evidence) return "metre";
  if (map.unit_evidence->source != UnitSource::kObjects)
    return fmt::format("metres, 1.00 +- {:.3f} (by the {})", map.unit_evidence->relative_sigma,
                       SensorOf(map.unit_evidence->source));
  return fmt::format("metres, 1.00 +- {:.2f} (by {} objects)", map.unit_evidence->relative_sigma,
                     map.unit_evidence->objects);
}

}  // namespace oaslam::apps
