#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::apps {

// Options that give a monocular map, whose unit is arbitrary, the metre as its unit.
struct ScaleSettings {
  std::string object;  // --scale-object CLASS=HEIGHT_M
  std::string from;    // --scale-from gt | T1:T2=METRES
};

void AddScaleOptions(CLI::App& app, ScaleSettings& settings);

class MetricScale {
 public:
  // Throws InputError for settings that no map can satisfy.
  MetricScale(const ScaleSettings& settings, const ClassNames& names,
              const std::vector<StampedPose>& groundtruth);

  bool IsAskedFor() const { return kind_ != Kind::kNone; }
  // The length of one map unit in metres. Throws InputError where the map or the trajectory lacks
  // what is needed.
  double MetresPerUnit(const Map& map, const std::vector<StampedPose>& trajectory) const;

 private:
  enum class Kind { kNone, kObject, kGroundtruth, kDistance };
  double FromObjects(const Map& map) const;

  Kind kind_ = Kind::kNone;
  std::string text_;  // as given, for messages
  int category_id_ = 0;
  double metres_ = 0, from_s_ = 0, to_s_ = 0;
  std::vector<StampedPose> groundtruth_;
};

}  // namespace oaslam::apps
