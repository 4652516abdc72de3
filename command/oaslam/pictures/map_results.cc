#include "oaslam/pictures/map_results.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>

#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/map/parts.h"

namespace oaslam {
namespace {

using Json = nlohmann::ordered_json;

// Nine digits exceed the precision of the map; "-0" is avoided.
double Short(double x) {
  return x == 0 ? 0 : std::strtod(fmt::format("{:.9g}", x).c_str(), nullptr);
}
double FourPlaces(double x) { return std::round(x * 1e4) / 1e4; }

template <typename Vector>
Json ShortNumbers(const Vector& vector) {
  return JsonNumbers<Json>(Vector(vector.unaryExpr(&Short)));
}

// Mean score of its detections.
double Score(const Object& object) {
  double sum = 0;
  for (const ObjectObservation& o : object.observations) sum += o.score;
  return object.observations.empty() ? 0 : sum / static_cast<double>(object.observations.size());
}

Json ObjectJson(const Map& map, ObjectId id, const Object& object, const ClassNames& names) {
  Json json{{"id", id.value},
            {"category_id", object.category_id},
            {"category", NameOf(names, object.category_id)}};
  if (!object.name.empty()) json["name"] = object.name;
  for (const LabelShare& label : object.shares)  // none where all detections gave it the same label
    json["labels"].push_back({label.category_id, FourPlaces(label.share)});
  const Ellipsoid& e = object.ellipsoid;
  json["center"] = ShortNumbers(e.center);
  json["half_axes"] = ShortNumbers(e.half_axes);
  json["rotation"] =
      ShortNumbers(Eigen::Vector4d((e.rotation.w() < 0 ? -1.0 : 1.0) * e.rotation.coeffs()));
  json["observations"] = object.total_observations;
  json["score"] = FourPlaces(Score(object));
  if (const std::optional<ObjectId> whole = WholeOf(map, id)) json["part_of"] = whole->value;
  if (object.has_moved) json["moved"] = true;
  json["covariance_diag"] = ShortNumbers(Eigen::VectorXd(object.covariance.diagonal()));
  return json;
}

}  // namespace

void SaveObjectsJson(const std::string& path, const Map& map, const ClassNames& names) {
  std::string text;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state == ObjectState::kMapped)
      text += (text.empty() ? "\n" : ",\n") + JsonText(ObjectJson(map, id, object, names));
  });
  WriteTextFile(path, "[" + text + "\n]\n");
}

}  // namespace oaslam
