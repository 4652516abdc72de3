#include "oaslam/exports/map_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/map/parts.h"

namespace oaslam {
namespace {

// Nine digits exceed the precision of the map; "-0" is avoided.
template <typename Vector>
std::string Numbers(const Vector& vector) {
  std::vector<std::string> numbers;
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    numbers.push_back(fmt::format("{:.9g}", vector[i] == 0 ? 0.0 : vector[i]));
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

// Mean score of its detections.
double Score(const Object& object) {
  double sum = 0;
  for (const ObjectObservation& o : object.observations) sum += o.score;
  return object.observations.empty() ? 0 : sum / static_cast<double>(object.observations.size());
}

// Fields that most objects do not have.
std::string Special(const Map& map, ObjectId id, const Object& object) {
  const std::optional<ObjectId> whole = WholeOf(map, id);
  return (whole ? fmt::format(", \"part_of\": {}", whole->value) : "") +
         (object.has_moved ? ", \"moved\": true" : "");
}

std::string Named(const Object& object) {
  return object.name.empty() ? "" : ", \"name\": " + JsonText(nlohmann::json(object.name));
}

// Nothing where all detections gave it the same label.
std::string Labelled(const Object& object) {
  if (object.shares.empty()) return "";
  std::string text;
  for (const LabelShare& label : object.shares)
    text += fmt::format("{}[{}, {:.4f}]", text.empty() ? "" : ", ", label.category_id, label.share);
  return ",\n   \"labels\": [" + text + "]";
}

}  // namespace

void SaveObjectsJson(const std::string& path, const Map& map, const ClassNames& names) {
  std::string text;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const Ellipsoid& e = object.ellipsoid;
    const Eigen::Vector4d rotation = e.rotation.w() < 0 ? Eigen::Vector4d(-e.rotation.coeffs())
                                                        : Eigen::Vector4d(e.rotation.coeffs());
    text += fmt::format(
        "{}\n  {{\"id\": {}, \"category_id\": {}, \"category\": {}{}{},\n   \"center\": {},\n   "
        "\"half_axes\": {},\n   \"rotation\": {},\n"
        "   \"observations\": {}, \"score\": {:.4f}{},\n   \"covariance_diag\": {}}}",
        text.empty() ? "" : ",", id.value, object.category_id,
        JsonText(nlohmann::json(NameOf(names, object.category_id))), Named(object),
        Labelled(object), Numbers(e.center), Numbers(e.half_axes), Numbers(rotation),
        object.total_observations, Score(object), Special(map, id, object),
        Numbers(Eigen::VectorXd(object.covariance.diagonal())));
  });
  WriteTextFile(path, "[" + text + "\n]\n");
}

}  // namespace oaslam
