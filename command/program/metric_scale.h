#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::apps {

// Options that give a monocular map, whose unit is arbitrary, the metre as its unit.
struct ScaleSettings {
  std::string by = "auto";  // --scale auto | none
  std::string object;       // --scale-object CLASS=HEIGHT_M
  std::string from;         // --scale-from gt | T1:T2=METRES
};

void AddScaleOptions(CLI::App& app, ScaleSettings& settings);

// How a map is scaled to metres.
struct UnitChange {
  std::optional<double> metres_per_unit{};  // nothing: the map keeps its unit
  std::optional<UnitEvidence> by_objects{};
  std::string why_not{};  // why objects do not tell the unit, where they were asked
};

class MetricScale {
 public:
  // Throws InputError for settings that no map can satisfy.
  MetricScale(const ScaleSettings& settings, const ClassNames& names,
              const std::vector<StampedPose>& groundtruth);

  // What makes the map metric, or its metre better. Throws InputError where the map or the
  // trajectory lacks what the settings need.
  UnitChange ChangeOf(const SavedMap& saved, const std::vector<StampedPose>& trajectory) const;
  // Warns where the usual sizes of the objects contradict the unit that a metric map was given, or
  // the ground truth.
  void WarnOfContradiction(const SavedMap& saved, const std::vector<StampedPose>& trajectory) const;

 private:
  enum class Kind { kNone, kAuto, kObject, kGroundtruth, kDistance };
  double FromObjects(const Map& map) const;
  double MetresPerUnit(const Map& map, const std::vector<StampedPose>& trajectory) const;

  Kind kind_ = Kind::kNone;
  std::string text_;  // as given, for messages
  int category_id_ = 0;
  double metres_ = 0, from_s_ = 0, to_s_ = 0;
  std::vector<StampedPose> groundtruth_;
};

// Gives the map, without its submaps, its new unit.
void Apply(const UnitChange& change, SavedMap& saved);
// The unit of a map for a person: "arbitrary", "metre", "metres, 1.00 +- 0.06 (by 11 objects)".
std::string DescribeUnit(const Map& map);

}  // namespace oaslam::apps
