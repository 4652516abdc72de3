#pragma once

#include <string>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/map/map.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// Writes objects.json of docs/formats.md: the mapped objects, ascending by id.
void SaveObjectsJson(const std::string& path, const Map& map, const ClassNames& names);

struct MapPlot {
  const Map* map = nullptr;
  std::vector<StampedPose> trajectory{};
  std::vector<StampedPose> groundtruth{};  // already aligned to the map; may be empty
  std::vector<StampedPose> localized{};    // poses to mark with a heading; may be empty
  ClassNames names{};
  std::string title{};
};

// Top view (along Map::up where known, else the keyframes' mean up): landmarks, trajectory and
// ground truth, object ellipses with class names, a scale bar in the map's unit, a legend.
void SaveMapSvg(const std::string& path, const MapPlot& plot);

}  // namespace oaslam
