#include "oaslam/viewer/frame_message.h"

#include <Eigen/Eigenvalues>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/ellipse.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/viewer/map_delta.h"

namespace oaslam {
namespace {

using nlohmann::json;

json BoxNumbers(const Box& box) { return {box.x1, box.y1, box.x2, box.y2}; }

json DescribeDetections(const FrameView& view, const ClassNames& names) {
  json list = json::array();
  for (size_t i = 0; i < view.frame.detections.size(); ++i) {
    const ObjectDetection& d = view.frame.detections[i];
    json entry{{"box", BoxNumbers(d.box)},
               {"score", d.score},
               {"category_id", d.category_id},
               {"category", NameOf(names, d.category_id)}};
    const std::optional<ObjectId> object =
        i < view.detected.size() ? view.map->ResolveObject(view.detected[i]) : std::nullopt;
    if (object) entry["object"] = object->value;
    list.push_back(std::move(entry));
  }
  return list;
}

// The mapped objects' outlines in the image.
json DescribeEllipses(const FrameView& view, const Rigid3& cam_from_world, const Camera& camera,
                      const ClassNames& names) {
  json list = json::array();
  const Box image{0, 0, static_cast<double>(camera.width), static_cast<double>(camera.height)};
  view.map->objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const std::optional<Ellipse> ellipse =
        ProjectToEllipse(object.ellipsoid, cam_from_world, camera);
    if (!ellipse || Intersection(BoundingBox(*ellipse), image).Area() <= 0) return;
    const PrincipalAxes axes = PrincipalAxesOf(ellipse->covariance);
    list.push_back(
        {{"object", id.value},
         {"label", object.name.empty() ? NameOf(names, object.category_id) : object.name},
         {"category_id", object.category_id},
         {"center", {ellipse->mean.x(), ellipse->mean.y()}},
         {"half_axes", {axes.major, axes.minor}},
         {"angle", axes.angle_rad},
         {"depth", (cam_from_world * object.ellipsoid.center).z()}});
  });
  return list;
}

json DescribeRelocalization(const Relocalization& found) {
  return {{"evidence", ToString(found.evidence)},
          {"confidence", found.confidence},
          {"points", found.points.inliers},
          {"objects", found.objects.matched.size()},
          {"why_not", found.why_not}};
}

// The ellipsoid of one standard deviation of the position, in the axes of the camera.
json DescribeSpread(const PoseCovariance& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance.topLeftCorner<3, 3>());
  Eigen::Matrix3d rotation = axes.eigenvectors();
  if (rotation.determinant() < 0) rotation.col(0) *= -1;
  const Eigen::Vector3d half_axes = axes.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Eigen::Quaterniond q(rotation);
  return {{"half_axes", {half_axes.x(), half_axes.y(), half_axes.z()}},
          {"rotation", {q.x(), q.y(), q.z(), q.w()}}};
}

void AddKeypoints(const FrameView& view, MessageBuilder& message) {
  if (!view.frame.features) return;
  const std::vector<Keypoint>& keypoints = view.frame.features->keypoints;
  std::vector<float> px;
  std::vector<uint32_t> landmarks;
  for (size_t i = 0; i < keypoints.size(); ++i) {
    px.insert(px.end(), {keypoints[i].px.x(), keypoints[i].px.y()});
    landmarks.push_back(i < view.landmarks.size() ? view.landmarks[i].value : LandmarkId::kInvalid);
  }
  message.Add("keypoints", px);
  message.Add("keypoint_landmarks", landmarks);
}

}  // namespace

void AddFrame(const FrameRecord& record, const ClassNames& names, std::span<const uint8_t> jpeg,
              MessageBuilder& message) {
  const FrameView& view = record.view;
  const TrackingResult& result = record.result;
  const Camera& camera = *view.frame.camera;
  json& frame = message.header["frame"];
  frame = {{"frame", result.frame},
           {"timestamp", result.timestamp},
           {"state", ToString(result.state)},
           {"keypoints", result.keypoints},
           {"matched", result.matched.value_or(0)},
           {"inliers", result.inliers.value_or(0)},
           {"objects", result.objects},
           {"confidence", result.confidence},
           {"uncertain", result.is_uncertain},
           {"ms",
            {{"total", result.ms_total},
             {"features", result.ms_features},
             {"track", result.ms_track},
             {"objects", result.ms_objects}}},
           {"camera",
            {{"width", camera.width},
             {"height", camera.height},
             {"fx", camera.fx},
             {"fy", camera.fy},
             {"cx", camera.cx},
             {"cy", camera.cy}}},
           {"detections", DescribeDetections(view, names)},
           {"ellipses", json::array()}};
  if (const std::optional<Rigid3> pose = result.PoseIn(result.world)) {
    frame["pose"] = PoseNumbers(*pose);
    frame["spread"] = DescribeSpread(result.covariance);
    frame["ellipses"] = DescribeEllipses(view, pose->Inverse(), camera, names);
  }
  if (view.relocalization) frame["relocalization"] = DescribeRelocalization(*view.relocalization);
  AddKeypoints(view, message);
  message.Add("jpeg", jpeg);
}

}  // namespace oaslam
