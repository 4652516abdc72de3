#include "oaslam/service/geopose_protocol.h"

#include <fmt/format.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <map>
#include <set>

#include "oaslam/formats/json_text.h"
#include "oaslam/util/base64.h"

namespace oaslam {
namespace {

constexpr int kMaxSide = 65535;       // pixels, as of JPEG
constexpr double kMaxTime_ms = 1e15;  // of the year 33,658; an int64_t holds it

// What the parameters of COLMAP's camera models are, in their order. Distortion is numbered as in
// Camera::distortion.
struct ColmapModel {
  LensModel lens;
  int focal_lengths;            // one for both axes, or two
  std::vector<int> distortion;  // -1: a coefficient that must be zero, as ours has none
};

const std::map<std::string, ColmapModel>& ColmapModels() {
  static const std::map<std::string, ColmapModel> models{
      {"SIMPLE_PINHOLE", {LensModel::kPinhole, 1, {}}},
      {"PINHOLE", {LensModel::kPinhole, 2, {}}},
      {"SIMPLE_RADIAL", {LensModel::kPinhole, 1, {0}}},
      {"RADIAL", {LensModel::kPinhole, 1, {0, 1}}},
      {"OPENCV", {LensModel::kPinhole, 2, {0, 1, 2, 3}}},
      {"FULL_OPENCV", {LensModel::kPinhole, 2, {0, 1, 2, 3, 4, -1, -1, -1}}},
      {"OPENCV_FISHEYE", {LensModel::kFisheye, 2, {0, 1, 2, 3}}},
      {"SIMPLE_RADIAL_FISHEYE", {LensModel::kFisheye, 1, {0}}},
      {"RADIAL_FISHEYE", {LensModel::kFisheye, 1, {0, 1}}},
  };
  return models;
}

// Nothing where the sender does not know its model.
std::optional<Camera> ReadCamera(const JsonInput& params, int width, int height) {
  const std::optional<JsonInput> name = params.Find("model");
  if (!name || name->Text().empty() || name->Text().starts_with("UNKNOWN") ||
      name->Text() == "unknown")
    return std::nullopt;
  const auto found = ColmapModels().find(name->Text());
  if (found == ColmapModels().end()) name->Refuse("the camera model is not supported");
  if (width == 0) params.Refuse("a camera needs the \"size\" of the image");
  const ColmapModel& model = found->second;
  const size_t count = model.focal_lengths + 2 + model.distortion.size();
  const std::vector<JsonInput> values = params["modelParams"].Items(count, count);
  auto next = values.begin();
  Camera camera;
  camera.model = model.lens;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = next++->Number(1e-3, 1e7);
  if (model.focal_lengths == 2) camera.fy = next++->Number(1e-3, 1e7);
  // COLMAP has the centre of the first pixel at (0.5, 0.5).
  camera.cx = next++->Number(-1e6, 1e6) - 0.5;
  camera.cy = next++->Number(-1e6, 1e6) - 0.5;
  for (const int coefficient : model.distortion) {
    const double value = next++->Number(-1e6, 1e6);
    if (coefficient >= 0)
      camera.distortion[coefficient] = value;
    else if (value != 0)
      std::prev(next)->Refuse("rational distortion is not supported: must be 0");
  }
  return camera;
}

bool IsImageFile(const std::string& bytes) {
  return bytes.starts_with("\xFF\xD8\xFF") || bytes.starts_with("\x89PNG\r\n\x1A\n");
}

// The bytes decide on the format, since some clients declare JPEG files as RGBA32.
void ReadBytes(const JsonInput& reading, const std::string& format, GeoPoseImage& image) {
  const JsonInput encoded = reading["imageBytes"];
  std::optional<std::string> bytes = DecodeBase64(encoded.Text());
  if (!bytes) encoded.Refuse("is no base64");
  image.bytes = std::move(*bytes);
  if (IsImageFile(image.bytes)) return;
  if (format != "GRAY8" && format != "RGBA32") encoded.Refuse("is no JPEG or PNG file");
  image.format = format == "GRAY8" ? GeoPoseImage::Format::kGray8 : GeoPoseImage::Format::kRgba32;
  const size_t expected = size_t{format == "GRAY8" ? 1u : 4u} * static_cast<size_t>(image.width) *
                          static_cast<size_t>(image.height);
  if (image.width == 0 || image.bytes.size() != expected)
    encoded.Refuse(
        fmt::format("is no JPEG or PNG file, and has {} bytes where {} of {} x {} have {}",
                    image.bytes.size(), format, image.width, image.height, expected));
}

// Nothing for a depth image.
std::optional<GeoPoseImage> ReadImage(const JsonInput& reading) {
  const std::string format =
      reading.Find("imageFormat") ? reading["imageFormat"].Text() : std::string();
  if (format == "DEPTH") return std::nullopt;
  GeoPoseImage image;
  if (const auto sensor = reading.Find("sensorId")) image.sensor = sensor->Text();
  if (const auto time = reading.Find("timestamp")) image.time_ms = time->Number(0, kMaxTime_ms);
  if (const auto orientation = reading.Find("imageOrientation"))
    if (const auto mirrored = orientation->Find("mirrored"); mirrored && mirrored->Boolean())
      mirrored->Refuse("mirrored images are not supported");
  if (const auto size = reading.Find("size")) {
    const std::vector<JsonInput> sides = size->Items(2, 2);
    image.width = sides[0].Integer(0, kMaxSide);
    image.height = sides[1].Integer(0, kMaxSide);
    if (image.width == 0 || image.height == 0) image.width = image.height = 0;
  }
  if (const auto params = reading.Find("params"))
    image.camera = ReadCamera(*params, image.width, image.height);
  ReadBytes(reading, format, image);
  return image;
}

// The ids of sensors that are no cameras.
std::set<std::string> OtherSensors(const JsonInput& request) {
  std::set<std::string> ids;
  if (const auto sensors = request.Find("sensors"))
    for (const JsonInput& sensor : sensors->Items(0, 100))
      if (sensor["type"].Text() != "camera") ids.insert(sensor["id"].Text());
  return ids;
}

void ReadLocation(const JsonInput& readings, GeoPoseRequest& request) {
  const auto locations = readings.Find("geolocationReadings");
  if (!locations) return;
  double newest = -1;
  for (const JsonInput& reading : locations->Items(0, 1000)) {
    const auto time = reading.Find("timestamp");
    const double time_ms = time ? time->Number(0, kMaxTime_ms) : 0;
    if (time_ms < newest) continue;
    newest = time_ms;
    const auto altitude = reading.Find("altitude");
    request.location = {reading["latitude"].Number(-90, 90), reading["longitude"].Number(-180, 180),
                        altitude ? altitude->Number(-20000, 1e6) : 0};
    request.accuracy_m.reset();
    if (const auto accuracy = reading.Find("accuracy"))
      request.accuracy_m = accuracy->Number(0, 1e8);
  }
}

}  // namespace

GeoPoseRequest ReadGeoPoseRequest(const std::string& text, size_t max_images) {
  const nlohmann::json json = ParseJson(text, "request");
  const JsonInput input(json, "request");
  GeoPoseRequest request;
  request.id = input["id"].Text();
  if (const auto type = input.Find("type"); type && type->Text() != "geopose")
    type->Refuse("must be \"geopose\"");
  if (const auto time = input.Find("timestamp")) request.time_ms = time->Number(0, kMaxTime_ms);
  const JsonInput readings = input["sensorReadings"];
  const std::set<std::string> others = OtherSensors(input);
  for (const JsonInput& reading : readings["cameraReadings"].Items(1, max_images)) {
    std::optional<GeoPoseImage> image = ReadImage(reading);
    if (!image) continue;
    if (others.contains(image->sensor))
      reading.Refuse("the sensor \"" + image->sensor + "\" is no camera");
    request.images.push_back(std::move(*image));
  }
  if (request.images.empty()) readings["cameraReadings"].Refuse("there are depth images only");
  ReadLocation(readings, request);
  if (const auto priors = input.Find("priorPoses"))
    for (const JsonInput& prior : priors->Items(0, 1000)) {
      // Earlier answers; some clients send the pose of each alone.
      const auto pose = prior.Find("geopose");
      request.prior_poses.push_back(ReadGeoPose(pose ? *pose : prior));
    }
  return request;
}

std::string WriteGeoPoseAnswer(const GeoPoseAnswer& answer) {
  const nlohmann::ordered_json json{
      {"id", answer.id},
      {"timestamp", static_cast<int64_t>(std::llround(answer.time_ms))},
      {"accuracy", {{"position", answer.position_m}, {"orientation", answer.orientation_deg}}},
      {"type", "geopose"},
      {"geopose", JsonOf(answer.pose)}};
  return JsonText(json);
}

}  // namespace oaslam
