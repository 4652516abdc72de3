#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "oaslam/exports/map_export.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// COLMAP has the centre of the first pixel at (0.5, 0.5), we have it at (0, 0).
constexpr double kPixelCenter = 0.5;

// COLMAP's ids are ours plus one, since they begin at 1.
uint32_t ColmapId(uint32_t id) { return id + 1; }

std::string CameraLine(size_t index, const Camera& c) {
  const auto& k = c.distortion;
  std::string model = "PINHOLE", distortion;
  if (c.model == LensModel::kFisheye) {
    model = "OPENCV_FISHEYE";
    distortion = fmt::format(" {} {} {} {}", k[0], k[1], k[2], k[3]);
  } else if (k[4] != 0) {
    model = "FULL_OPENCV";
    distortion = fmt::format(" {} {} {} {} {} 0 0 0", k[0], k[1], k[2], k[3], k[4]);
  } else if (c.HasDistortion()) {
    model = "OPENCV";
    distortion = fmt::format(" {} {} {} {}", k[0], k[1], k[2], k[3]);
  }
  return fmt::format("{} {} {} {} {} {} {} {}{}\n", index + 1, model, c.width, c.height, c.fx, c.fy,
                     c.cx + kPixelCenter, c.cy + kPixelCenter, distortion);
}

// Converts a point of the ideal image to pixels of COLMAP's camera model.
Eigen::Vector2d ColmapPixel(const Camera& camera, const Eigen::Vector2d& ideal) {
  return Distort(camera, ideal) + Eigen::Vector2d::Constant(kPixelCenter);
}

const Camera& CameraOf(const Map& map, const Keyframe& keyframe) {
  return map.cameras[static_cast<size_t>(keyframe.camera)];
}

// The landmarks that at least two of the images see: images of some keyframes may be missing.
std::set<LandmarkId> SeenLandmarks(const Map& map, const KeyframeImages& images) {
  std::set<LandmarkId> seen;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    if (std::ranges::count_if(landmark.observations, [&](const Observation& o) {
          return images.contains(o.keyframe);
        }) >= 2)
      seen.insert(id);
  });
  return seen;
}

std::string ImageLines(KeyframeId id, const Keyframe& keyframe, const Map& map,
                       const std::string& name, const std::set<LandmarkId>& seen) {
  Eigen::Quaterniond q = keyframe.cam_from_world.rotation;
  if (q.w() < 0) q.coeffs() *= -1;
  const Eigen::Vector3d& t = keyframe.cam_from_world.translation;
  std::string lines =
      fmt::format("{} {} {} {} {} {} {} {} {} {}\n", ColmapId(id.value), q.w(), q.x(), q.y(), q.z(),
                  t.x(), t.y(), t.z(), keyframe.camera + 1, name);
  for (size_t i = 0; i < keyframe.features->keypoints.size(); ++i) {
    const Eigen::Vector2d px =
        ColmapPixel(CameraOf(map, keyframe), keyframe.features->keypoints[i].px.cast<double>());
    const LandmarkId landmark = keyframe.landmarks[i];
    fmt::format_to(std::back_inserter(lines), "{}{:.4f} {:.4f} {}", i == 0 ? "" : " ", px.x(),
                   px.y(),
                   seen.contains(landmark) ? static_cast<int64_t>(ColmapId(landmark.value)) : -1);
  }
  return lines + '\n';
}

std::string PointLine(LandmarkId id, const Landmark& landmark, const Map& map,
                      const KeyframeImages& images, const Rgb& color) {
  std::string track;
  double error = 0;
  int views = 0;
  for (const Observation& o : landmark.observations) {
    if (!images.contains(o.keyframe)) continue;
    const Keyframe& keyframe = map.keyframes.At(o.keyframe);
    const Camera& camera = CameraOf(map, keyframe);
    const Eigen::Vector2d seen = keyframe.features->keypoints[o.keypoint].px.cast<double>();
    const Eigen::Vector2d projected =
        ProjectIdeal(camera, keyframe.cam_from_world * landmark.position);
    error += (ColmapPixel(camera, seen) - ColmapPixel(camera, projected)).norm();
    fmt::format_to(std::back_inserter(track), " {} {}", ColmapId(o.keyframe.value), o.keypoint);
    ++views;
  }
  const Eigen::Vector3d& x = landmark.position;
  return fmt::format("{} {} {} {} {} {} {} {:.4f}{}\n", ColmapId(id.value), x.x(), x.y(), x.z(),
                     color[0], color[1], color[2], error / views, track);
}

}  // namespace

void ExportColmap(const std::string& folder, const SavedMap& saved, const KeyframeImages& images) {
  const Map& map = saved.map;
  for (const auto& [id, image] : images)
    if (image.name.find_first_of(" \t\r\n\v\f") != std::string::npos)
      throw BadInput(
          "{}: COLMAP reads names of images up to a blank; rename the image or its folder",
          image.name);
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (size_t i = 0; i < map.cameras.size(); ++i) cameras += CameraLine(i, map.cameras[i]);
  const std::set<LandmarkId> seen = SeenLandmarks(map, images);
  const std::map<LandmarkId, Rgb> colors = ColorsOfLandmarks(map, images, folder);
  std::string views =
      "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as (X Y POINT3D_ID)\n";
  for (const auto& [id, image] : images)
    views += ImageLines(id, map.keyframes.At(id), map, image.name, seen);
  std::string points = "# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID POINT2D_IDX)\n";
  for (const LandmarkId id : seen)
    points += PointLine(id, map.landmarks.At(id), map, images, colors.at(id));
  WriteTextFile(folder + "/cameras.txt", cameras);
  WriteTextFile(folder + "/images.txt", views);
  WriteTextFile(folder + "/points3D.txt", points);
}

}  // namespace oaslam
