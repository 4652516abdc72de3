#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>

#include "oaslam/geometry/similarity.h"
#include "oaslam/service/json_input.h"

namespace oaslam {

// On the WGS-84 ellipsoid.
struct GeoPosition {
  double latitude_deg = 0, longitude_deg = 0;
  double height_m = 0;  // above the ellipsoid, not above the sea

  bool operator==(const GeoPosition&) const = default;
};

// The straight distance in metres.
double Distance_m(const GeoPosition& a, const GeoPosition& b);

// A pose of OGC GeoPose 1.0, Basic-Quaternion. The rotation takes vectors of the body to the local
// tangent plane at the position: x east, y north, z up.
//
// The standard leaves the axes of the body to the application. For a camera they are x forward, y
// left, z up, which is how the clients of Open AR Cloud read the answer of a positioning service: a
// camera that looks east and is held level has no rotation.
struct GeoPose {
  GeoPosition position;
  Eigen::Quaterniond enu_from_body = Eigen::Quaterniond::Identity();
};

// {"position": {"lat", "lon", "h"}, "quaternion": {"x", "y", "z", "w"}}
nlohmann::ordered_json JsonOf(const GeoPose& pose);
GeoPose ReadGeoPose(const JsonInput& json);

// Where a map is on the earth.
struct Georeference {
  GeoPosition origin;
  Similarity enu_from_map;  // to metres in the tangent plane at the origin: east, north, up
  double residual_m = 0;    // root mean square over the points that it was fitted to
};

// What a document may refer to, of the map.
struct GeoreferencedMap {
  std::optional<Eigen::Vector3d> up;  // world direction against gravity
  bool is_metric = false;
  std::map<std::string, Rigid3> anchors;  // world from anchor
};

// Reads the document of a georeference, in one of two forms:
//   {"points": [{"map": [x, y, z], "latitude", "longitude", "height"}, ...]}
// with three points or more that are not on a line, to which a similarity is fitted (Umeyama 1991);
//   {"anchor": NAME or "pose": {"position", "rotation"}, "latitude", "longitude", "height",
//    "heading", "metres_per_unit"}
// with the heading of the front of the anchor or pose, its +z axis, in degrees clockwise from
// north. It needs the map's vertical, and the unit's length unless the map is metric. Throws
// InputError.
Georeference ReadGeoreference(const std::string& document, const GeoreferencedMap& map);

// The origin of the georeference of a document, which is read without the map. Throws InputError.
GeoPosition ReadOrigin(const std::string& document);

// The pose of a camera of the map.
GeoPose GeoPoseOfCamera(const Georeference& georeference, const Rigid3& world_from_cam);

}  // namespace oaslam
