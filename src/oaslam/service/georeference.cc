#include "oaslam/service/georeference.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <numbers>
#include <vector>

namespace oaslam {
namespace {

using GeographicLib::Geocentric;
using GeographicLib::LocalCartesian;

LocalCartesian PlaneAt(const GeoPosition& p) {
  return LocalCartesian(p.latitude_deg, p.longitude_deg, p.height_m);
}

Eigen::Vector3d Geocenter(const GeoPosition& p) {
  Eigen::Vector3d x;
  Geocentric::WGS84().Forward(p.latitude_deg, p.longitude_deg, p.height_m, x[0], x[1], x[2]);
  return x;
}

// A place in the tangent plane at another one.
Eigen::Vector3d InPlane(const LocalCartesian& plane, const GeoPosition& p) {
  Eigen::Vector3d x;
  plane.Forward(p.latitude_deg, p.longitude_deg, p.height_m, x[0], x[1], x[2]);
  return x;
}

// The columns are the body's axes in the camera's.
const Eigen::Quaterniond& CamFromBody() {
  static const Eigen::Quaterniond rotation(
      (Eigen::Matrix3d() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished());
  return rotation;
}

GeoPosition ReadPosition(const JsonInput& json, const char* latitude, const char* longitude,
                         const char* height) {
  return {json[latitude].Number(-90, 90), json[longitude].Number(-180, 180),
          json[height].Number(-20000, 1e6)};
}

GeoPosition ReadPosition(const JsonInput& json) {
  return ReadPosition(json, "latitude", "longitude", "height");
}

// How far points are from a line through them, relative to how far they extend along it.
double Flatness(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centered = points.colwise() - points.rowwise().mean();
  const Eigen::Vector3d extent =
      Eigen::JacobiSVD<Eigen::Matrix3d>(centered * centered.transpose()).singularValues();
  return extent[0] > 0 ? std::sqrt(extent[1] / extent[0]) : 0;
}

Georeference ReadPoints(const JsonInput& document) {
  document.Only({"points"});
  const std::vector<JsonInput> items = document["points"].Items(3, 10000);
  Georeference result;
  Eigen::Matrix3Xd in_map(3, items.size()), in_enu(3, items.size());
  result.origin = ReadPosition(items[0]);
  const LocalCartesian plane = PlaneAt(result.origin);
  for (size_t i = 0; i < items.size(); ++i) {
    items[i].Only({"map", "latitude", "longitude", "height"});
    in_map.col(i) = items[i]["map"].Vector();
    in_enu.col(i) = InPlane(plane, ReadPosition(items[i]));
  }
  // Below, an error of a centimetre over a metre turns the map about the line by half a turn.
  constexpr double kMinFlatness = 0.01;
  for (const auto& [points, which] :
       {std::pair(&in_map, "in the map"), std::pair(&in_enu, "on the earth")})
    if (const double flatness = Flatness(*points); !(flatness >= kMinFlatness))
      document["points"].Refuse(
          fmt::format("{} they are on a line: their extent across it is {:.4f} of that along it, "
                      "at least {} is needed",
                      which, flatness, kMinFlatness));
  const Eigen::Matrix4d fit = Eigen::umeyama(in_map, in_enu);
  const double scale = fit.col(0).head<3>().norm();
  result.enu_from_map = Similarity(
      scale, Eigen::Quaterniond(Eigen::Matrix3d(fit.topLeftCorner<3, 3>() / scale)).normalized(),
      fit.topRightCorner<3, 1>());
  double sum = 0;
  for (Eigen::Index i = 0; i < in_map.cols(); ++i)
    sum += (result.enu_from_map * in_map.col(i) - in_enu.col(i)).squaredNorm();
  result.residual_m = std::sqrt(sum / static_cast<double>(in_map.cols()));
  return result;
}

// The axes front, left and up as columns.
Eigen::Matrix3d Axes(const Eigen::Vector3d& front, const Eigen::Vector3d& up) {
  Eigen::Matrix3d axes;
  axes << front, up.cross(front), up;
  return axes;
}

Georeference ReadHeading(const JsonInput& document, const GeoreferencedMap& map) {
  document.Only(
      {"anchor", "pose", "latitude", "longitude", "height", "heading", "metres_per_unit"});
  const std::optional<JsonInput> anchor = document.Find("anchor");
  if (anchor.has_value() == document.Find("pose").has_value())
    document.Refuse("must have \"points\", or one of \"anchor\" and \"pose\"");
  if (anchor && !map.anchors.contains(anchor->Text()))
    anchor->Refuse("the map has no anchor \"" + anchor->Text() + "\"");
  const Rigid3 pose = anchor ? map.anchors.at(anchor->Text()) : document["pose"].Pose();
  if (!map.up)
    document.Refuse("the vertical of the map is not known: give three points or more instead");
  const std::optional<JsonInput> unit = document.Find("metres_per_unit");
  if (!unit && !map.is_metric)
    document.Refuse("\"metres_per_unit\" is missing, and the unit of the map is not the metre");

  Georeference result;
  result.origin = ReadPosition(document);
  const double heading = document["heading"].Number(-360, 360) * std::numbers::pi / 180;
  const Eigen::Vector3d up = map.up->normalized(), front = pose.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d level = front - up.dot(front) * up;
  if (level.norm() < 0.1)
    document.Refuse(fmt::format("the front of the {} is vertical, so that it has no heading",
                                anchor ? "anchor" : "pose"));
  const Eigen::Matrix3d rotation =
      Axes({std::sin(heading), std::cos(heading), 0}, Eigen::Vector3d::UnitZ()) *
      Axes(level.normalized(), up).transpose();
  result.enu_from_map =
      Similarity(unit ? unit->Number(1e-6, 1e6) : 1, Eigen::Quaterniond(rotation).normalized(),
                 Eigen::Vector3d::Zero());
  result.enu_from_map.translation = -(result.enu_from_map * pose.translation);
  return result;
}

}  // namespace

double Distance_m(const GeoPosition& a, const GeoPosition& b) {
  return (Geocenter(a) - Geocenter(b)).norm();
}

nlohmann::ordered_json JsonOf(const GeoPose& pose) {
  const Eigen::Quaterniond& q = pose.enu_from_body;
  return {{"position",
           {{"lat", pose.position.latitude_deg},
            {"lon", pose.position.longitude_deg},
            {"h", pose.position.height_m}}},
          {"quaternion", {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}}};
}

GeoPose ReadGeoPose(const JsonInput& json) {
  const JsonInput q = json["quaternion"];
  return {
      ReadPosition(json["position"], "lat", "lon", "h"),
      q.Rotation(q["x"].Number(), q["y"].Number(), q["z"].Number(), q["w"].Number()),
  };
}

Georeference ReadGeoreference(const std::string& document, const GeoreferencedMap& map) {
  const nlohmann::json json = ParseJson(document, "georeference");
  const JsonInput input(json, "georeference");
  return input.Find("points") ? ReadPoints(input) : ReadHeading(input, map);
}

GeoPosition ReadOrigin(const std::string& document) {
  const nlohmann::json json = ParseJson(document, "georeference");
  const JsonInput input(json, "georeference");
  const auto points = input.Find("points");
  return ReadPosition(points ? points->Items(1).front() : input);
}

GeoPose GeoPoseOfCamera(const Georeference& georeference, const Rigid3& world_from_cam) {
  const Similarity& enu_from_map = georeference.enu_from_map;
  const Eigen::Vector3d x = enu_from_map * world_from_cam.translation;
  GeoPose pose;
  GeoPosition& p = pose.position;
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  std::vector<double> rotation(9);
  PlaneAt(georeference.origin)
      .Reverse(x[0], x[1], x[2], p.latitude_deg, p.longitude_deg, p.height_m, rotation);
  const Eigen::Quaterniond origin_from_here(
      Eigen::Matrix3d(Eigen::Map<const RowMajor>(rotation.data())));
  pose.enu_from_body = (origin_from_here.conjugate() * enu_from_map.rotation *
                        world_from_cam.rotation * CamFromBody())
                           .normalized();
  // Of the two quaternions of a rotation the same one, whatever it was computed from.
  if (pose.enu_from_body.w() < 0) pose.enu_from_body.coeffs() *= -1;
  return pose;
}

}  // namespace oaslam
