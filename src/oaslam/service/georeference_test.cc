#include "oaslam/service/georeference.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "expect_input_error.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

using ::testing::HasSubstr;

// The example of EPSG Guidance Note 7-2 (2019), sections 4.1.1 and 4.1.2: a point on WGS-84, its
// geocentric coordinates, and those in the tangent plane at an origin.
const GeoPosition kPoint{53 + 48 / 60. + 33.820 / 3600, 2 + 7 / 60. + 46.380 / 3600, 73};
const Eigen::Vector3d kGeocentric(3771793.968, 140253.342, 5124304.349);
const GeoPosition kOrigin{55, 5, 200};
const Eigen::Vector3d kTopocentric(-189013.869, -128642.040, -4220.171);

const GeoPosition kPlaces[] = {kOrigin,          {90, 0, 10},      {-90, 30, 2800},   {0, 180, 0},
                               {-33.9, -180, 5}, {89.9999, 77, 0}, {-41.3, 174.8, 20}};

Eigen::Vector3d RandomVector(Rng& rng, double size) {
  return {rng.Uniform(-size, size), rng.Uniform(-size, size), rng.Uniform(-size, size)};
}

Eigen::Quaterniond RandomRotation(Rng& rng) {
  return Eigen::Quaterniond(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1))
      .normalized();
}

// A camera held level that looks along `front`; both in a frame with z up.
Rigid3 LevelCamera(const Eigen::Vector3d& center, const Eigen::Vector3d& front) {
  Eigen::Matrix3d world_from_cam;
  world_from_cam << front.cross(Eigen::Vector3d::UnitZ()), -Eigen::Vector3d::UnitZ(), front;
  return {world_from_cam, center};
}

TEST(Georeference, AgreesWithThePublishedExample) {
  Georeference reference;
  reference.origin = kOrigin;
  const GeoPosition found =
      GeoPoseOfCamera(reference, {Eigen::Quaterniond::Identity(), kTopocentric}).position;
  EXPECT_NEAR(found.latitude_deg, kPoint.latitude_deg, 1e-8);  // a millimetre
  EXPECT_NEAR(found.longitude_deg, kPoint.longitude_deg, 1e-8);
  EXPECT_NEAR(found.height_m, kPoint.height_m, 1e-3);
  EXPECT_NEAR(Distance_m(kPoint, {0, 0, 0}), (kGeocentric - Eigen::Vector3d(6378137, 0, 0)).norm(),
              1e-3);
  EXPECT_NEAR(Distance_m({90, 0, 0}, {-90, 12, 0}), 2 * 6356752.3142, 1e-3);
}

TEST(Georeference, ALevelCameraThatLooksEastIsNotRotated) {
  Georeference reference;
  reference.origin = {48.1, 11.5, 500};
  const auto pose = [&](double x, double y) {
    return GeoPoseOfCamera(reference, LevelCamera({0, 0, 0}, {x, y, 0})).enu_from_body;
  };
  EXPECT_LT(pose(1, 0).angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
  const double half = std::numbers::sqrt2 / 2;
  EXPECT_LT((pose(0, 1).coeffs() - Eigen::Vector4d(0, 0, half, half)).norm(), 1e-12);
  // Down, with the upper edge of the image towards east: forward is down, left is north.
  const Rigid3 down((Eigen::Matrix3d() << 0, -1, 0, -1, 0, 0, 0, 0, -1).finished(),
                    Eigen::Vector3d(0, 0, 0));
  const Eigen::Matrix3d axes = GeoPoseOfCamera(reference, down).enu_from_body.toRotationMatrix();
  EXPECT_LT((axes.col(0) + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((axes.col(1) - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((axes.col(2) - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(Georeference, TheTangentPlaneIsThatAtTheCamera) {
  // A quarter of the way around the equator, up there is east here.
  Georeference reference;
  reference.origin = {0, 0, 0};
  // Down here is east there, and west here is down there: it looks east, and is held level.
  const Rigid3 camera((Eigen::Matrix3d() << 0, -1, 0, -1, 0, 0, 0, 0, -1).finished(),
                      Eigen::Vector3d(6378137, 0, -6378137));
  const GeoPose pose = GeoPoseOfCamera(reference, camera);
  EXPECT_LT(Distance_m(pose.position, {0, 90, 0}), 1e-3);
  EXPECT_LT(pose.enu_from_body.angularDistance(Eigen::Quaterniond::Identity()), 1e-9);
}

// The axes east, north and up at a place as columns, in a frame that is fixed to the earth.
Eigen::Matrix3d EarthFromPlane(const GeoPosition& p) {
  const double degree = std::numbers::pi / 180;
  return (Eigen::AngleAxisd(p.longitude_deg * degree, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(-p.latitude_deg * degree, Eigen::Vector3d::UnitY()))
             .toRotationMatrix() *
         (Eigen::Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished();
}

TEST(Georeference, DistancesAndDirectionsAreThoseOfTheMap) {
  Rng rng(5);
  for (const GeoPosition& place : kPlaces)
    for (int i = 0; i < 20; ++i) {
      Georeference reference;
      reference.origin = place;
      reference.enu_from_map =
          Similarity(rng.Uniform(0.1, 10), RandomRotation(rng), RandomVector(rng, 100));
      const Rigid3 camera(RandomRotation(rng), RandomVector(rng, 100));
      const GeoPose pose = GeoPoseOfCamera(reference, camera);
      EXPECT_GE(pose.enu_from_body.w(), 0);
      EXPECT_LE(std::abs(pose.position.latitude_deg), 90);
      EXPECT_LE(std::abs(pose.position.longitude_deg), 180);
      const GeoPose first = GeoPoseOfCamera(reference, {});
      EXPECT_NEAR(Distance_m(pose.position, first.position),
                  reference.enu_from_map.scale * camera.translation.norm(), 1e-6);
      const Eigen::Matrix3d earth_from_body = EarthFromPlane(pose.position) * pose.enu_from_body,
                            earth_from_cam = EarthFromPlane(place) *
                                             reference.enu_from_map.rotation * camera.rotation;
      EXPECT_LT((earth_from_body.col(0) - earth_from_cam.col(2)).norm(), 1e-7);  // forward
      EXPECT_LT((earth_from_body.col(2) + earth_from_cam.col(1)).norm(), 1e-7);  // up
    }
}

TEST(Georeference, LongitudesGoOnBeyondTheDateline) {
  Georeference reference;
  reference.origin = {-17, 180, 0};
  const auto longitude = [&](double east) {
    return GeoPoseOfCamera(reference, {Eigen::Quaterniond::Identity(), {east, 0, 0}})
        .position.longitude_deg;
  };
  EXPECT_NEAR(longitude(-100), 179.99906, 1e-5);
  EXPECT_NEAR(longitude(100), -179.99906, 1e-5);
}

std::string PointsDocument(const Georeference& truth, Rng& rng, int points, double noise_m) {
  nlohmann::json items = nlohmann::json::array();
  for (int i = 0; i < points; ++i) {
    const Eigen::Vector3d x = RandomVector(rng, 10);
    const Eigen::Vector3d noise(rng.Gaussian(noise_m), rng.Gaussian(noise_m),
                                rng.Gaussian(noise_m));
    const GeoPosition p = GeoPoseOfCamera(truth, {Eigen::Quaterniond::Identity(),
                                                  x + truth.enu_from_map.rotation.conjugate() *
                                                          noise / truth.enu_from_map.scale})
                              .position;
    items.push_back({{"map", {x[0], x[1], x[2]}},
                     {"latitude", p.latitude_deg},
                     {"longitude", p.longitude_deg},
                     {"height", p.height_m}});
  }
  return nlohmann::json{{"points", items}}.dump();
}

TEST(Georeference, IsFittedToPoints) {
  Rng rng(3);
  for (const GeoPosition& place : kPlaces)
    for (const int points : {3, 4, 30}) {
      Georeference truth;
      truth.origin = place;
      truth.enu_from_map =
          Similarity(rng.Uniform(0.5, 3), RandomRotation(rng), RandomVector(rng, 50));
      const Georeference found = ReadGeoreference(PointsDocument(truth, rng, points, 0), {});
      EXPECT_LT(found.residual_m, 1e-5);
      const Rigid3 camera(RandomRotation(rng), RandomVector(rng, 10));
      EXPECT_LT(Distance_m(GeoPoseOfCamera(found, camera).position,
                           GeoPoseOfCamera(truth, camera).position),
                1e-3);
      EXPECT_LT(GeoPoseOfCamera(found, camera)
                    .enu_from_body.angularDistance(GeoPoseOfCamera(truth, camera).enu_from_body),
                1e-4);
    }
}

TEST(Georeference, TellsTheResidualOfThePoints) {
  Rng rng(4);
  Georeference truth;
  truth.origin = {48, 11, 500};
  truth.enu_from_map = Similarity(2, RandomRotation(rng), {});
  truth.enu_from_map.translation = {1, 2, 3};
  const Georeference found = ReadGeoreference(PointsDocument(truth, rng, 500, 0.1), {});
  EXPECT_NEAR(found.residual_m, 0.1 * std::numbers::sqrt3, 0.01);
  EXPECT_NEAR(found.enu_from_map.scale, 2, 0.01);
}

GeoreferencedMap TiltedMap() {
  GeoreferencedMap map;
  map.up = Eigen::Vector3d(0, -3, 0);  // y down, as of a camera held level; of any length
  map.is_metric = true;
  // It stands upright at (1, 2, 3), its front towards +x of the map.
  Eigen::Matrix3d axes;
  axes << Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX();
  map.anchors["door"] = Rigid3(axes, Eigen::Vector3d(1, 2, 3));
  return map;
}

TEST(Georeference, FollowsFromAnAnchorAndItsHeading) {
  const Georeference found = ReadGeoreference(
      R"({"anchor": "door", "latitude": -33.9, "longitude": 151.2, "height": 40, "heading": 90})",
      TiltedMap());
  // A camera at the door that looks where its front does: east.
  Eigen::Matrix3d axes;
  axes << -Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX();
  const GeoPose pose = GeoPoseOfCamera(found, {axes, {1, 2, 3}});
  EXPECT_NEAR(pose.position.latitude_deg, -33.9, 1e-9);
  EXPECT_NEAR(pose.position.longitude_deg, 151.2, 1e-9);
  EXPECT_NEAR(pose.position.height_m, 40, 1e-6);
  EXPECT_LT(pose.enu_from_body.angularDistance(Eigen::Quaterniond::Identity()), 1e-9);
  // A step up in the map, and one to the front.
  EXPECT_NEAR(GeoPoseOfCamera(found, {axes, {1, 1, 3}}).position.height_m, 41, 1e-6);
  EXPECT_GT(GeoPoseOfCamera(found, {axes, {2, 2, 3}}).position.longitude_deg, 151.2);
}

TEST(Georeference, FollowsFromAPoseAndTheLengthOfTheUnit) {
  GeoreferencedMap map = TiltedMap();
  map.is_metric = false;
  // A camera that looks along +z of the map, a little down.
  const double tilt = 0.2;
  const std::string document = fmt::format(
      R"({{"pose": {{"position": [0, 0, 0], "rotation": [{}, 0, 0, {}]}}, "latitude": 0,
          "longitude": 0, "height": 0, "heading": -45, "metres_per_unit": 2.5}})",
      -std::sin(tilt / 2), std::cos(tilt / 2));
  const Georeference found = ReadGeoreference(document, map);
  EXPECT_NEAR(found.enu_from_map.scale, 2.5, 1e-12);
  const double half = 2.5 * std::numbers::sqrt2 / 2;
  EXPECT_LT(
      (found.enu_from_map * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(-half, half, 0)).norm(),
      1e-9);
  EXPECT_LT(
      (found.enu_from_map * Eigen::Vector3d(1, -1, 0) - Eigen::Vector3d(half, half, 2.5)).norm(),
      1e-9);
}

TEST(Georeference, GeoPosesAreWrittenAndRead) {
  const GeoPose pose{{-12.5, 170.25, 3.5}, Eigen::Quaterniond(0.8, 0, 0.6, 0)};
  const std::string text = JsonOf(pose).dump();
  EXPECT_EQ(text, R"({"position":{"lat":-12.5,"lon":170.25,"h":3.5},)"
                  R"("quaternion":{"x":0.0,"y":0.6,"z":0.0,"w":0.8}})");
  const nlohmann::json read_json = ParseJson(text, "pose");
  const GeoPose read = ReadGeoPose(JsonInput(read_json, "pose"));
  EXPECT_EQ(read.position, pose.position);
  EXPECT_LT((read.enu_from_body.coeffs() - pose.enu_from_body.coeffs()).norm(), 1e-15);
}

TEST(Georeference, WrongDocumentsAreRefused) {
  GeoreferencedMap map = TiltedMap();
  const auto problem = [&](const std::string& document) {
    return InputErrorOf([&] { ReadGeoreference(document, map); });
  };
  const auto points = [](const std::string& items) {
    std::string document = "{\"points\": [";
    document += items;
    return document + "]}";
  };
  const auto point = [](double x, double latitude) {
    return fmt::format(R"({{"map": [{}, 0, 0], "latitude": {}, "longitude": 0, "height": 0}})", x,
                       latitude);
  };
  const std::string place = R"("latitude": 1, "longitude": 2, "height": 3)";
  EXPECT_THAT(problem("{"), HasSubstr("georeference: is no JSON"));
  EXPECT_THAT(problem("[]"), HasSubstr("georeference: must be an object"));
  EXPECT_THAT(problem("{}"), HasSubstr("must have \"points\", or one of"));
  EXPECT_THAT(problem(points(point(0, 0) + "," + point(1, 0))),
              HasSubstr("georeference.points: has 2 items, at least 3"));
  EXPECT_THAT(problem(points(point(0, 0) + "," + point(1, 1) + "," + point(2, 2))),
              HasSubstr("in the map they are on a line"));
  EXPECT_THAT(problem(points(
                  R"({"map": [0, 0, 0], "latitude": 1, "longitude": 0, "height": 0},
             {"map": [1, 0, 0], "latitude": 1, "longitude": 0, "height": 1},
             {"map": [0, 1, 0], "latitude": 1, "longitude": 0, "height": 2})")),
              HasSubstr("on the earth they are on a line"));
  EXPECT_THAT(problem(points(point(0, 0) + "," + point(1, 91) + "," + point(2, 2))),
              HasSubstr("georeference.points[1].latitude: 91, allowed: -90 to 90"));
  EXPECT_THAT(problem(points("1,2,3")), HasSubstr("points[0]: must be an object"));
  EXPECT_THAT(problem("{" + place + R"(, "anchor": "window", "heading": 0})"),
              HasSubstr("georeference.anchor: the map has no anchor \"window\""));
  EXPECT_THAT(problem("{" + place + R"(, "anchor": "door"})"), HasSubstr("\"heading\" is missing"));
  EXPECT_THAT(problem("{" + place + R"(, "anchor": "door", "heading": 0, "hight": 1})"),
              HasSubstr("unknown key \"hight\""));
  EXPECT_THAT(
      problem(
          "{" + place +
          R"(, "pose": {"position": [0, 0, 0], "rotation": [0.7071068, 0, 0, 0.7071068]}, "heading": 0})"),
      HasSubstr("the front of the pose is vertical"));
  EXPECT_THAT(problem("{" + place +
                      R"(, "pose": {"position": [0, 0], "rotation": [0, 0, 0, 1]}, "heading": 0})"),
              HasSubstr("georeference.pose.position: has 2 items, at least 3"));
  EXPECT_THAT(
      problem("{" + place +
              R"(, "pose": {"position": [0, 0, 0], "rotation": [0, 0, 0, 0]}, "heading": 0})"),
      HasSubstr("georeference.pose.rotation: a quaternion of length 0"));
  map.is_metric = false;
  EXPECT_THAT(problem("{" + place + R"(, "anchor": "door", "heading": 0})"),
              HasSubstr("\"metres_per_unit\" is missing"));
  EXPECT_THAT(problem("{" + place + R"(, "anchor": "door", "heading": 0, "metres_per_unit": 0})"),
              HasSubstr("metres_per_unit: 0, allowed"));
  map.up.reset();
  EXPECT_THAT(problem("{" + place + R"(, "anchor": "door", "heading": 0, "metres_per_unit": 1})"),
              HasSubstr("the vertical of the map is not known"));
}

}  // namespace
}  // namespace oaslam
