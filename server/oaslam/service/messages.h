#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/camera.h"
#include "oaslam/net/json_input.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// The JSON of the service's messages (docs/service.md).
using Json = nlohmann::ordered_json;

// What a client says of its camera.
struct CameraChoice {
  bool is_auto = false;
  std::string fov;  // "fov:DEGREES"; empty: none
  Camera camera;    // if neither

  bool operator==(const CameraChoice&) const = default;
};

CameraChoice ReadCameraChoice(const JsonInput& json);
// The camera for images of this size; nothing where it is to be found. Throws InputError where it
// is for another size.
std::optional<Camera> CameraFor(const CameraChoice& choice, const cv::Size& size);

// One image of a request, or of a stream.
struct ImageRequest {
  std::string bytes;  // JPEG or PNG; empty: found by detections alone
  CameraChoice camera;
  std::optional<std::vector<Detection>> detections;
  std::optional<Eigen::Vector3d> gravity_in_cam;
  std::vector<AngularVelocity> angular_velocity;
  std::vector<ImuSample> imu;
  std::optional<Rigid3> cam_from_imu;
  std::optional<Rigid3> prior;  // world_from_cam
  double time = 0;
  std::optional<MotionInput> motion;
  // Without its key points, of which `bytes` holds this number.
  std::optional<ImageFeatures> features;
  int feature_count = 0;
};

// Takes how the IMU lies from a request that says it; returns whether `known` has changed.
bool TakeImuPose(const ImageRequest& request, std::optional<Rigid3>& known);

// All but the image and its key points.
ImageInput ImageInputOf(const ImageRequest& request);

// All but the bytes. A missing camera is "auto".
ImageRequest ReadImageRequest(const JsonInput& json);

Json JsonOf(const Eigen::Vector3d& v);
Json JsonOf(const Rigid3& pose);
Json JsonOf(const Camera& camera);
Json JsonOf(const Ellipsoid& ellipsoid);
Json JsonOf(const AnchorPose& anchor, int64_t version);

// The mapped objects: id, category, name where it has one, ellipsoid.
Json JsonOfObjects(const SavedMap& saved);
// The mapped objects in front of the camera, with their boxes in the image (for a lens with
// distortion: in its ideal image). Objects that are hidden by others are among them.
Json JsonOfObjectsInView(const SavedMap& saved, const Camera& camera, const Rigid3& world_from_cam);
// The answer to an image of a stream, which begins with the id of its header.
Json JsonOfPose(const ImageRequest& request, const nlohmann::json& header, TrackingState state);
// The answer to one image, without objects.
Json JsonOf(const RelocalizationResult& result, const std::optional<Camera>& camera);

Json JsonOfError(const std::string& message);

}  // namespace oaslam
