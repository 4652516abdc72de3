#include "oaslam/service/messages.h"

#include <fmt/format.h>

#include "oaslam/camera_file.h"
#include "oaslam/detection_file.h"
#include "oaslam/formats/detection_json.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

constexpr int kMostFeatures = 10'000, kMostLevels = 16;
constexpr int kMostPixels = 100'000;  // on a side: more than any camera has

Camera ReadCamera(const JsonInput& json) {
  json.Only({"name", "model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "is_guess"});
  Camera camera;
  if (const auto model = json.Find("model")) {
    if (model->Text() == ToString(LensModel::kFisheye))
      camera.model = LensModel::kFisheye;
    else if (model->Text() != ToString(LensModel::kPinhole))
      model->Refuse(fmt::format("\"{}\", allowed: pinhole, fisheye", model->Text()));
  }
  camera.width = json["width"].Integer(1, kMostPixels);
  camera.height = json["height"].Integer(1, kMostPixels);
  camera.fx = json["fx"].Number();
  camera.fy = json.Find("fy").value_or(json["fx"]).Number();
  const auto cx = json.Find("cx"), cy = json.Find("cy");
  camera.cx = cx ? cx->Number() : (camera.width - 1) / 2.0;
  camera.cy = cy ? cy->Number() : (camera.height - 1) / 2.0;
  if (const auto distortion = json.Find("distortion")) {
    const std::vector<JsonInput> items = distortion->Items(0, camera.distortion.size());
    for (size_t i = 0; i < items.size(); ++i) camera.distortion[i] = items[i].Number();
  }
  CheckCalibration(camera, json.place());
  return camera;
}

// Without a value the motion is not known.
MotionInput ReadMotion(const std::optional<JsonInput>& given) {
  constexpr size_t kMostDepths = 4000, kMostKeyframes = 100;  // ten times what is usual
  MotionInput motion;
  motion.is_known = given.has_value();
  if (!given) return motion;
  const JsonInput& json = *given;
  json.Only({"run", "image", "pose", "preliminary", "agreeing", "keyframe", "keyframes", "depths"});
  motion.run = json["run"].Integer(0, INT32_MAX - 1);
  motion.image = json["image"].Integer(0, INT32_MAX);
  motion.odom_from_cam = json["pose"].Pose();
  if (const auto is_preliminary = json.Find("preliminary"))
    motion.is_preliminary = is_preliminary->Boolean();
  if (const auto agreeing = json.Find("agreeing")) motion.agreeing = agreeing->Number(0, 1);
  if (const auto is_keyframe = json.Find("keyframe")) motion.is_keyframe = is_keyframe->Boolean();
  if (const auto keyframes = json.Find("keyframes"))
    for (const JsonInput& keyframe : keyframes->Items(0, kMostKeyframes)) {
      const std::vector<JsonInput> row = keyframe.Items(8, 8);
      motion.corrected.push_back(
          {row[0].Integer(0, INT32_MAX),
           {keyframe.Rotation(row[4].Number(), row[5].Number(), row[6].Number(), row[7].Number()),
            {row[1].Number(), row[2].Number(), row[3].Number()}}});
    }
  if (const auto depths = json.Find("depths"))
    for (const JsonInput& depth : depths->Items(0, kMostDepths)) {
      const std::vector<JsonInput> row = depth.Items(3, 3);
      motion.depths.push_back({{row[0].Number(), row[1].Number()}, row[2].Number()});
    }
  return motion;
}

}  // namespace

CameraChoice ReadCameraChoice(const JsonInput& json) {
  CameraChoice choice;
  if (!json.value().is_string()) {
    choice.camera = ReadCamera(json);
    return choice;
  }
  choice.is_auto = json.Text() == "auto";
  if (choice.is_auto) return choice;
  if (!json.Text().starts_with("fov:"))
    json.Refuse(fmt::format("\"{}\", allowed: auto, fov:DEGREES or an object", json.Text()));
  choice.fov = json.Text();
  LoadCamera(choice.fov, {640, 480});  // refuses a bad one
  return choice;
}

std::optional<Camera> CameraFor(const CameraChoice& choice, const cv::Size& size) {
  if (choice.is_auto) return std::nullopt;
  if (!choice.fov.empty()) return LoadCamera(choice.fov, size);
  if (choice.camera.width != size.width || choice.camera.height != size.height)
    throw BadInput("camera: is for images of {} x {}, this one has {} x {}", choice.camera.width,
                   choice.camera.height, size.width, size.height);
  return choice.camera;
}

ImageRequest ReadImageRequest(const JsonInput& json) {
  constexpr size_t kMostDetections = 1000;  // a detector finds some ten
  constexpr size_t kMostSamples = 2000;     // two seconds of a fast gyroscope
  ImageRequest request;
  const auto camera = json.Find("camera");
  if (camera)
    request.camera = ReadCameraChoice(*camera);
  else
    request.camera.is_auto = true;
  if (const auto detections = json.Find("detections")) {
    detections->Items(0, kMostDetections);
    request.detections = DetectionsFromJson(detections->value(), detections->place());
  }
  if (const auto gravity = json.Find("gravity")) {
    request.gravity_in_cam = gravity->Vector();
    if (!(request.gravity_in_cam->norm() > 0)) gravity->Refuse("has no direction");
  }
  if (const auto samples = json.Find("angular_velocity")) {
    for (const JsonInput& sample : samples->Items(0, kMostSamples)) {
      const std::vector<JsonInput> row = sample.Items(4, 4);
      request.angular_velocity.push_back(
          {row[0].Number(), {row[1].Number(), row[2].Number(), row[3].Number()}});
    }
  }
  if (const auto samples = json.Find("imu"))
    for (const JsonInput& sample : samples->Items(0, kMostSamples)) {
      const std::vector<JsonInput> row = sample.Items(7, 7);
      const auto vector = [&](size_t i) {
        return Eigen::Vector3d(row[i].Number(), row[i + 1].Number(), row[i + 2].Number());
      };
      request.imu.push_back({row[0].Number(), vector(1), vector(4)});
    }
  if (const auto pose = json.Find("cam_from_imu")) request.cam_from_imu = pose->Pose();
  if (const auto prior = json.Find("prior")) request.prior = prior->Pose();
  if (const auto time = json.Find("time")) request.time = time->Number();
  if (json.value().contains("motion")) request.motion = ReadMotion(json.Find("motion"));
  if (const auto features = json.Find("features")) {
    features->Only({"count", "lowest", "levels", "factor"});
    request.feature_count = (*features)["count"].Integer(0, kMostFeatures);
    request.features = ImageFeatures{{},
                                     (*features)["levels"].Integer(1, kMostLevels),
                                     (*features)["factor"].Number(),
                                     (*features)["lowest"].Number()};
    if (request.camera.is_auto || !request.camera.fov.empty())
      json.Refuse("camera: must have its intrinsics where key points are sent");
  }
  return request;
}

bool TakeImuPose(const ImageRequest& request, std::optional<Rigid3>& known) {
  const std::optional<Rigid3>& given = request.cam_from_imu;
  if (!given || (known && known->translation == given->translation &&
                 known->rotation.coeffs() == given->rotation.coeffs()))
    return false;
  known = given;
  return true;
}

ImageInput ImageInputOf(const ImageRequest& request) {
  ImageInput input;
  input.timestamp = request.time;
  input.detections = request.detections.value_or(std::vector<Detection>());
  input.gravity_in_cam = request.gravity_in_cam;
  input.angular_velocity = request.angular_velocity;
  input.imu = request.imu;
  input.motion = request.motion;
  return input;
}

Json JsonOf(const Eigen::Vector3d& v) { return JsonNumbers<Json>(v); }

Json JsonOf(const Rigid3& pose) {
  const double sign = pose.rotation.w() < 0 ? -1 : 1;
  return {{"position", JsonOf(pose.translation)},
          {"rotation", JsonNumbers<Json>(Eigen::Vector4d(sign * pose.rotation.coeffs()))}};
}

Json JsonOf(const Camera& c) {
  return {{"model", ToString(c.model)},
          {"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"distortion", c.distortion}};
}

Json JsonOf(const Ellipsoid& e) {
  const Eigen::Quaterniond& q = e.rotation;
  return {{"center", JsonOf(e.center)},
          {"half_axes", JsonOf(e.half_axes)},
          {"rotation", JsonNumbers<Json>(q.coeffs())}};
}

Json JsonOf(const AnchorPose& anchor, int64_t version) {
  Json json = {{"name", anchor.name},
               {"model", anchor.model},
               {"size", anchor.size},
               {"pose", JsonOf(anchor.world_from_anchor)}};
  if (anchor.object) json["object"] = anchor.object->value;
  json["version"] = version;
  return json;
}

Json JsonOfObjects(const SavedMap& saved) {
  Json objects = Json::array();
  saved.map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    Json json = {{"id", id.value}, {"category", NameOf(saved.class_names, object.category_id)}};
    if (!object.name.empty()) json["name"] = object.name;
    json["ellipsoid"] = JsonOf(object.ellipsoid);
    objects.push_back(std::move(json));
  });
  return objects;
}

Json JsonOfObjectsInView(const SavedMap& saved, const Camera& camera,
                         const Rigid3& world_from_cam) {
  // Of the outline that the image shows: with less, a person would not say that the object is in
  // it.
  constexpr double kLeastShare = 0.3;
  const Rigid3 cam_from_world = world_from_cam.Inverse();
  const Box bounds = IdealImageBounds(camera);
  Json objects = Json::array();
  saved.map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const std::optional<Box> box = ProjectToBox(object.ellipsoid, cam_from_world, camera);
    if (!box || ShareInside(*box, bounds) < kLeastShare) return;
    const Box shown = Intersection(*box, bounds);
    objects.push_back({{"id", id.value},
                       {"category", NameOf(saved.class_names, object.category_id)},
                       {"box", {shown.x1, shown.y1, shown.x2, shown.y2}}});
  });
  return objects;
}

Json JsonOfPose(const ImageRequest& request, const nlohmann::json& header, TrackingState state) {
  return {{"type", "pose"},
          {"id", header.value("id", nlohmann::json())},
          {"time", request.time},
          {"state", ToString(state)}};
}

Json JsonOf(const RelocalizationResult& result, const std::optional<Camera>& camera) {
  if (!result.world_from_cam)
    return {{"found", false}, {"why_not", result.why_not}, {"confidence", result.confidence}};
  Json json = {{"found", true},
               {"pose", JsonOf(*result.world_from_cam)},
               {"confidence", result.confidence},
               {"evidence", ToString(result.evidence)},
               {"inlier_points", result.inlier_points},
               {"matched_objects", result.matched_objects},
               {"sigma_position", result.sigma_position}};
  if (camera) json["camera"] = JsonOf(*camera);
  return json;
}

Json JsonOfError(const std::string& message) { return {{"error", message}}; }

}  // namespace oaslam
