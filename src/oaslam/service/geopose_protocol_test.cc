#include "oaslam/service/geopose_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "expect_input_error.h"
#include "oaslam/util/base64.h"

namespace oaslam {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kJpeg = "\xFF\xD8\xFF\xE0 and so on";

json Privacy() {
  return {{"dataRetention", json::array()},
          {"dataAcceptableUse", json::array()},
          {"dataSanitizationApplied", json::array()},
          {"dataSanitizationRequested", json::array()}};
}

// A request as clients send it, with all that the protocol has.
json Request() {
  const json reading{{"timestamp", 1700000000123},
                     {"sensorId", "0"},
                     {"privacy", Privacy()},
                     {"sequenceNumber", 0},
                     {"imageFormat", "JPG"},
                     {"size", {640, 480}},
                     {"imageBytes", EncodeBase64(kJpeg)},
                     {"imageOrientation", {{"mirrored", false}, {"rotation", 90}}},
                     {"params", {{"model", "PINHOLE"}, {"modelParams", {500, 510, 320, 240}}}}};
  const auto location = [](double time, double latitude) {
    return json{{"timestamp", time},    {"sensorId", "1"},
                {"privacy", Privacy()}, {"latitude", latitude},
                {"longitude", 11},      {"altitude", 520},
                {"accuracy", 8},        {"altitudeAccuracy", nullptr},
                {"heading", nullptr},   {"speed", 0}};
  };
  const json pose{{"position", {{"lat", 48}, {"lon", 11}, {"h", 500}}},
                  {"quaternion", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}};
  json other_pose = pose;
  other_pose["position"]["h"] = 501;
  return {
      {"id", "a request"},
      {"timestamp", 1700000000200},
      {"type", "geopose"},
      {"sensors",
       {{{"id", "0"}, {"type", "camera"}, {"name", "rear"}},
        {{"id", "1"}, {"type", "geolocation"}}}},
      {"sensorReadings",
       {{"cameraReadings", {reading}},
        {"geolocationReadings", {location(1000, 48.1), location(3000, 48.3), location(2000, 48.2)}},
        {"wiFiReadings", json::array()},
        {"accelerometerReadings", {{{"timestamp", 1}, {"x", 0}, {"y", 0}, {"z", 9.8}}}}}},
      {"priorPoses",
       {{{"id", "before"},
         {"timestamp", 1},
         {"type", "geopose"},
         {"accuracy", {{"position", 1}, {"orientation", 1}}},
         {"geopose", pose}},
        other_pose}}};
}

json& Reading(json& request) { return request["sensorReadings"]["cameraReadings"][0]; }

TEST(GeoPoseProtocol, RequestsAreRead) {
  const GeoPoseRequest request = ReadGeoPoseRequest(Request().dump(), 3);
  EXPECT_EQ(request.id, "a request");
  EXPECT_EQ(request.time_ms, 1700000000200);
  ASSERT_EQ(request.images.size(), 1u);
  const GeoPoseImage& image = request.images[0];
  EXPECT_EQ(image.sensor, "0");
  EXPECT_EQ(image.time_ms, 1700000000123);
  EXPECT_EQ(image.format, GeoPoseImage::Format::kFile);
  EXPECT_EQ(image.bytes, kJpeg);
  ASSERT_TRUE(image.camera);
  EXPECT_EQ(image.camera->model, LensModel::kPinhole);
  EXPECT_EQ(image.camera->width, 640);
  EXPECT_EQ(image.camera->height, 480);
  EXPECT_EQ(image.camera->fx, 500);
  EXPECT_EQ(image.camera->fy, 510);
  EXPECT_EQ(image.camera->cx, 319.5);
  EXPECT_EQ(image.camera->cy, 239.5);
  EXPECT_FALSE(image.camera->HasDistortion());
  EXPECT_EQ(request.location, (GeoPosition{48.3, 11, 520}));
  EXPECT_EQ(request.accuracy_m, 8);
  ASSERT_EQ(request.prior_poses.size(), 2u);
  EXPECT_EQ(request.prior_poses[0].position, (GeoPosition{48, 11, 500}));
  EXPECT_EQ(request.prior_poses[1].position.height_m, 501);
}

TEST(GeoPoseProtocol, LittleIsEnough) {
  const GeoPoseRequest request = ReadGeoPoseRequest(
      json{{"id", "1"},
           {"sensorReadings", {{"cameraReadings", {{{"imageBytes", EncodeBase64(kJpeg)}}}}}}}
          .dump(),
      1);
  EXPECT_FALSE(request.images[0].camera);
  EXPECT_FALSE(request.location);
  EXPECT_FALSE(request.accuracy_m);
}

TEST(GeoPoseProtocol, CamerasOfColmapAreRead) {
  const auto camera = [](const std::string& model, const json& values) {
    json request = Request();
    Reading(request)["params"] = {{"model", model}, {"modelParams", values}};
    return ReadGeoPoseRequest(request.dump(), 1).images[0].camera;
  };
  EXPECT_FALSE(camera("UNKNOWN_CAMERA", json::array()));
  EXPECT_FALSE(camera("UNKNOWN", json::array()));
  EXPECT_EQ(camera("SIMPLE_PINHOLE", {400, 320, 240})->fy, 400);
  const Camera radial = *camera("RADIAL", {400, 321, 241, 0.1, -0.2});
  EXPECT_EQ(radial.cx, 320.5);
  EXPECT_THAT(radial.distortion, ElementsAre(0.1, -0.2, 0, 0, 0));
  EXPECT_THAT(camera("OPENCV", {1, 2, 3, 4, 5, 6, 7, 8})->distortion, ElementsAre(5, 6, 7, 8, 0));
  EXPECT_THAT(camera("FULL_OPENCV", {1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0})->distortion,
              ElementsAre(5, 6, 7, 8, 9));
  const Camera fisheye = *camera("OPENCV_FISHEYE", {1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_EQ(fisheye.model, LensModel::kFisheye);
  EXPECT_THAT(fisheye.distortion, ElementsAre(5, 6, 7, 8, 0));
  EXPECT_EQ(camera("SIMPLE_RADIAL_FISHEYE", {400, 320, 240, 0.1})->model, LensModel::kFisheye);
}

TEST(GeoPoseProtocol, ImagesAreWhatTheirBytesAre) {
  json request = Request();
  Reading(request)["imageFormat"] = "RGBA32";
  EXPECT_EQ(ReadGeoPoseRequest(request.dump(), 1).images[0].format, GeoPoseImage::Format::kFile);
  Reading(request)["size"] = {3, 2};
  Reading(request)["imageBytes"] = EncodeBase64(std::string(24, 'x'));
  EXPECT_EQ(ReadGeoPoseRequest(request.dump(), 1).images[0].format, GeoPoseImage::Format::kRgba32);
  Reading(request)["imageFormat"] = "GRAY8";
  EXPECT_THAT(InputErrorOf([&] { ReadGeoPoseRequest(request.dump(), 1); }),
              HasSubstr("has 24 bytes where GRAY8 of 3 x 2 have 6"));
  Reading(request)["imageBytes"] = EncodeBase64(std::string(6, 'x'));
  const GeoPoseImage image = ReadGeoPoseRequest(request.dump(), 1).images[0];
  EXPECT_EQ(image.format, GeoPoseImage::Format::kGray8);
  EXPECT_EQ(image.bytes, "xxxxxx");
}

TEST(GeoPoseProtocol, DepthImagesAreReadOver) {
  json request = Request();
  json depth = Reading(request);
  depth["imageFormat"] = "DEPTH";
  depth["imageBytes"] = "?";
  request["sensorReadings"]["cameraReadings"].insert(
      request["sensorReadings"]["cameraReadings"].begin(), depth);
  EXPECT_EQ(ReadGeoPoseRequest(request.dump(), 2).images.size(), 1u);
  request["sensorReadings"]["cameraReadings"] = {depth};
  EXPECT_THAT(InputErrorOf([&] { ReadGeoPoseRequest(request.dump(), 2); }),
              HasSubstr("there are depth images only"));
}

TEST(GeoPoseProtocol, EveryWrongShapeIsRefused) {
  const auto problem = [](const std::function<void(json&)>& change) {
    json request = Request();
    change(request);
    return InputErrorOf([&] { ReadGeoPoseRequest(request.dump(), 2); });
  };
  const auto reading = [&](const std::string& key, const json& value) {
    return problem([&](json& request) { Reading(request)[key] = value; });
  };
  EXPECT_THAT(problem([](json& r) { r = 1; }), HasSubstr("request: must be an object"));
  EXPECT_THAT(problem([](json& r) { r.erase("id"); }), HasSubstr("\"id\" is missing"));
  EXPECT_THAT(problem([](json& r) { r["id"] = 5; }), HasSubstr("request.id: must be a string"));
  EXPECT_THAT(problem([](json& r) { r["type"] = "other"; }),
              HasSubstr("request.type: must be \"geopose\""));
  EXPECT_THAT(problem([](json& r) { r["timestamp"] = "now"; }),
              HasSubstr("request.timestamp: must be a number"));
  EXPECT_THAT(problem([](json& r) { r.erase("sensorReadings"); }),
              HasSubstr("\"sensorReadings\" is missing"));
  EXPECT_THAT(problem([](json& r) { r["sensorReadings"]["cameraReadings"] = json::array(); }),
              HasSubstr("cameraReadings: has 0 items, at least 1"));
  EXPECT_THAT(problem([](json& r) {
                r["sensorReadings"]["cameraReadings"] = {Reading(r), Reading(r), Reading(r)};
              }),
              HasSubstr("cameraReadings: has 3 items, at most 2"));
  EXPECT_THAT(problem([](json& r) { r["sensors"][0]["type"] = "wifi"; }),
              HasSubstr("cameraReadings[0]: the sensor \"0\" is no camera"));
  EXPECT_THAT(problem([](json& r) { r["sensors"] = {1}; }),
              HasSubstr("request.sensors[0]: must be an object"));
  EXPECT_THAT(reading("imageBytes", "****"), HasSubstr("imageBytes: is no base64"));
  EXPECT_THAT(reading("imageBytes", EncodeBase64("text")), HasSubstr("is no JPEG or PNG file"));
  EXPECT_THAT(reading("imageBytes", nullptr), HasSubstr("\"imageBytes\" is missing"));
  EXPECT_THAT(reading("size", {640}), HasSubstr("size: has 1 items"));
  EXPECT_THAT(reading("size", {640, 1.5}), HasSubstr("size[1]: must be an integer"));
  EXPECT_THAT(reading("size", {640, -1}), HasSubstr("size[1]: -1, allowed: 0 to 65535"));
  EXPECT_THAT(reading("imageOrientation", {{"mirrored", true}}),
              HasSubstr("mirrored images are not supported"));
  EXPECT_THAT(reading("params", {{"model", "FOV"}, {"modelParams", {1, 2, 3, 4, 5}}}),
              HasSubstr("params.model: the camera model is not supported"));
  EXPECT_THAT(reading("params", {{"model", "PINHOLE"}, {"modelParams", {1, 2, 3}}}),
              HasSubstr("modelParams: has 3 items, at least 4"));
  EXPECT_THAT(reading("params", {{"model", "PINHOLE"}, {"modelParams", {0, 2, 3, 4}}}),
              HasSubstr("modelParams[0]: 0, allowed: 0.001"));
  EXPECT_THAT(reading("params", {{"model", "FULL_OPENCV"},
                                 {"modelParams", {1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0.1, 0}}}),
              HasSubstr("modelParams[10]: rational distortion is not supported"));
  EXPECT_THAT(reading("size", nullptr), HasSubstr("a camera needs the \"size\""));
  EXPECT_THAT(
      problem([](json& r) { r["sensorReadings"]["geolocationReadings"][1]["latitude"] = 100; }),
      HasSubstr("geolocationReadings[1].latitude: 100, allowed: -90 to 90"));
  EXPECT_THAT(problem([](json& r) { r["priorPoses"][0]["geopose"]["quaternion"]["w"] = 3; }),
              HasSubstr("priorPoses[0].geopose.quaternion: a quaternion of length 3"));
  EXPECT_THAT(InputErrorOf([] { ReadGeoPoseRequest("{\"id\": ", 2); }),
              HasSubstr("request: is no JSON"));
  EXPECT_THAT(InputErrorOf([] { ReadGeoPoseRequest("{\"id\": 1e999}", 2); }),
              HasSubstr("request: "));
  EXPECT_THAT(InputErrorOf([] { ReadGeoPoseRequest(std::string(100'000, '['), 2); }),
              HasSubstr("request: is nested"));
}

TEST(GeoPoseProtocol, AnswersAreWritten) {
  const GeoPoseAnswer answer{"a \"request\"",
                             1700000000123.4,
                             {{48.5, 11.25, 500}, Eigen::Quaterniond(0.8, 0, 0, 0.6)},
                             0.125,
                             0.5};
  EXPECT_EQ(WriteGeoPoseAnswer(answer),
            R"({"id":"a \"request\"","timestamp":1700000000123,)"
            R"("accuracy":{"position":0.125,"orientation":0.5},"type":"geopose",)"
            R"("geopose":{"position":{"lat":48.5,"lon":11.25,"h":500.0},)"
            R"("quaternion":{"x":0.0,"y":0.0,"z":0.6,"w":0.8}}})");
}

}  // namespace
}  // namespace oaslam
