#include "oaslam/evaluation/object_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "oaslam/evaluation/trajectory_metrics.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

using Json = nlohmann::json;

Eigen::Vector3d ReadVector(const Json& value) {
  const auto v = value.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

// Reads each entry of the list by `read`; an error names the entry.
template <typename Read>
std::vector<EvaluatedObject> ReadObjects(const std::string& path, const char* list, Read&& read) {
  std::vector<EvaluatedObject> objects;
  size_t index = 0;
  try {
    const Json root = Json::parse(ReadTextFile(path));
    for (const Json& entry : root.is_object() ? root.at(list) : root) {
      EvaluatedObject object;
      object.category_id = entry.at("category_id").get<int>();
      object.name = entry.value("category", fmt::format("class {}", object.category_id));
      read(entry, object.ellipsoid);
      if (!(object.ellipsoid.half_axes.minCoeff() > 0))
        throw BadInput("{}: object {}: half axes must be above 0", path, index);
      objects.push_back(std::move(object));
      ++index;
    }
  } catch (const Json::exception& error) {
    throw BadInput("{}: object {}: {}", path, index, error.what());
  }
  return objects;
}

double MeanSize(const Ellipsoid& e) { return std::cbrt(e.half_axes.prod()); }

}  // namespace

std::vector<EvaluatedObject> LoadObjects(const std::string& path) {
  return ReadObjects(path, "objects", [](const Json& entry, Ellipsoid& e) {
    e.center = ReadVector(entry.at("center"));
    e.half_axes = ReadVector(entry.at("half_axes"));
    const auto q = entry.at("rotation").get<std::array<double, 4>>();
    e.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
  });
}

std::vector<EvaluatedObject> LoadTrueObjects(const std::string& path) {
  return ReadObjects(path, "objects", [](const Json& entry, Ellipsoid& e) {
    const Json& shape = entry.at("ellipsoid");
    e.center = ReadVector(shape.at("center"));
    e.half_axes = ReadVector(shape.at("semi_axes"));
    Eigen::Matrix3d rotation;
    for (int row = 0; row < 3; ++row)
      rotation.row(row) = ReadVector(shape.at("rotation").at(static_cast<size_t>(row))).transpose();
    e.rotation = Eigen::Quaterniond(rotation).normalized();
  });
}

ObjectReport EvaluateObjects(const std::vector<EvaluatedObject>& mapped,
                             const std::vector<EvaluatedObject>& truth,
                             const Alignment& truth_from_map) {
  ObjectReport report;
  std::vector<bool> taken(truth.size());
  std::vector<double> centres, sizes;
  for (size_t m = 0; m < mapped.size(); ++m) {
    const Eigen::Vector3d center = truth_from_map * mapped[m].ellipsoid.center;
    ObjectMatch best{m, truth.size(), kMaxCentreShare, 0};
    for (size_t t = 0; t < truth.size(); ++t) {
      if (taken[t] || truth[t].category_id != mapped[m].category_id) continue;
      const double share =
          (center - truth[t].ellipsoid.center).norm() / truth[t].ellipsoid.half_axes.maxCoeff();
      if (share < best.centre) best.truth = t, best.centre = share;
    }
    if (best.truth == truth.size()) continue;
    taken[best.truth] = true;
    best.log_size = std::abs(std::log(truth_from_map.scale * MeanSize(mapped[m].ellipsoid) /
                                      MeanSize(truth[best.truth].ellipsoid)));
    report.matches.push_back(best);
    centres.push_back(best.centre);
    sizes.push_back(best.log_size);
  }
  report.recall = static_cast<double>(report.matches.size()) /
                  static_cast<double>(std::max<size_t>(truth.size(), 1));
  report.precision = static_cast<double>(report.matches.size()) /
                     static_cast<double>(std::max<size_t>(mapped.size(), 1));
  report.median_centre = StatisticsOf(std::move(centres)).median;
  report.median_log_size = StatisticsOf(std::move(sizes)).median;
  return report;
}

}  // namespace oaslam
