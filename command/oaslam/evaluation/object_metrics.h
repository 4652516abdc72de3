#pragma once

#include <string>
#include <vector>

#include "oaslam/evaluation/alignment.h"
#include "oaslam/types.h"

namespace oaslam {

struct EvaluatedObject {
  int category_id = 0;
  std::string name;  // of the category
  Ellipsoid ellipsoid;
};

// Loads objects.json of a run. Throws InputError.
std::vector<EvaluatedObject> LoadObjects(const std::string& path);
// Loads objects_gt.json: {"objects": [{category_id, category, ellipsoid: {center, rotation[3][3],
// semi_axes}}]}. Throws InputError.
std::vector<EvaluatedObject> LoadTrueObjects(const std::string& path);

// A mapped object is correct if the centre of a true object of its class, not matched by another
// one, is within this share of that object's longest half axis: inside the object, so that two
// neighbours are told apart.
constexpr double kMaxCentreShare = 0.75;

struct ObjectMatch {
  size_t mapped = 0, truth = 0;
  double centre = 0;    // distance over the true object's longest half axis
  double log_size = 0;  // |log| of the ratio of the mean sizes (cube roots of the volumes)
};

struct ObjectReport {
  std::vector<ObjectMatch> matches;
  double recall = 0, precision = 0;
  double median_centre = 0, median_log_size = 0;
};

ObjectReport EvaluateObjects(const std::vector<EvaluatedObject>& mapped,
                             const std::vector<EvaluatedObject>& truth,
                             const Alignment& truth_from_map);

}  // namespace oaslam
