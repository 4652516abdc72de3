#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "oaslam/ids.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A named pose in the map at which an application draws virtual content, in the world of that map.
// The library does not compute whether a real object or a wall occludes the content.
struct AnchorPose {
  // `model` names the content that stands there; only the application knows what it means.
  std::string name{}, model{};
  double size = 0;           // of the content's longest side, map units
  Rigid3 world_from_anchor;  // content: y up, standing on the origin, front towards +z (glTF)
  std::optional<ObjectId> object{};  // the object that it stands on
  // The anchor's pose in the camera frame of the newest image. Only Slam::Anchors sets it, and only
  // where that image has a pose.
  std::optional<Rigid3> cam_from_anchor{};
};

// A request to place content: at a pixel of the newest image, where a ray meets the map, or at a
// pose:
//
//   const AnchorReport placed = slam.PlaceAnchor({.model = "flag", .pixel = pixel});
//   if (!placed.IsDone()) std::cerr << placed.why_not << "\n";
//   const AnchorReport on_top = slam.PlaceAnchor({.model = "label", .object = id});
struct AnchorRequest {
  std::string name{};   // empty: the name of the model with a number
  std::string model{};  // 1 to 64 bytes, no control character
  // A pixel of the newest image that Slam::Process took. Its ray replaces `origin` and `direction`.
  std::optional<Eigen::Vector2d> pixel{};
  // The ray, in the map's frame; the direction may have any length.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();
  // The content stands on top of this mapped object and faces the origin of the ray; without a ray
  // it faces the keyframe that saw the object last. Without an object the content stands on the
  // plane of the landmarks around the ray.
  std::optional<ObjectId> object{};
  double size = 0;  // map units; 0: a size that suits the place
  // Where the content stands, world_from_anchor; pixel, ray and object are not used then.
  std::optional<Rigid3> pose{};
};

// The answer to a request that concerns an anchor.
struct AnchorReport {
  std::string name{};     // the anchor's, as it is now; empty where nothing was changed
  std::string why_not{};  // why the request was refused; empty where it was carried out

  // Whether the request was carried out.
  bool IsDone() const { return why_not.empty(); }
};

// Changes to an anchor.
struct AnchorEdit {
  std::optional<std::string> name{}, model{};
  std::optional<double> size{};  // map units
  double turn_rad = 0;           // about its y axis
  std::optional<Rigid3> pose{};  // world_from_anchor; detaches the anchor from its object
};

// What a ray may meet in a map. kObject: the front of a mapped object's ellipsoid. kPlane: the
// plane fitted to most landmarks around the ray, such as a table or a wall. kLandmark: the landmark
// that is nearest to the ray.
enum class HitKind { kObject, kPlane, kLandmark };

// What a ray meets in the map, in the world of that map:
//
//   const std::vector<RayHit> hits = slam.Cast(pixel);  // the nearest first
//   if (!hits.empty() && hits[0].kind == HitKind::kPlane) Draw(hits[0].position, hits[0].normal);
struct RayHit {
  HitKind kind = HitKind::kPlane;
  double distance = 0;  // from the ray's origin, map units
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  // Of the surface, towards the ray's origin, of length 1; zero for a landmark.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  std::optional<ObjectId> object{};      // that it meets
  std::optional<LandmarkId> landmark{};  // that it meets
};

}  // namespace oaslam
