#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/service/geopose_protocol.h"
#include "oaslam/service/localize.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// A request takes at most as long as this many images in one map, so that it does not keep a worker
// from others for long.
constexpr size_t kMostGeoPoseImages = 4, kMostGeoPoseMaps = 8;

struct PlacedMap {
  std::shared_ptr<const ServedMap> map;
  Georeference georeference;
};

// The names of the maps with a georeference near the device, nearest first. None is loaded.
std::vector<std::string> MapsNear(ServiceState& state, const GeoPoseRequest& request) {
  constexpr double kNear_m = 2000;  // further than a map reaches
  std::vector<std::pair<double, std::string>> near;
  for (const StoredMap& stored : state.shelf.store().Maps()) {
    try {
      const auto edits = state.shelf.Edits(stored.name);
      if (!edits->georeference) continue;
      const double distance_m =
          request.location ? Distance_m(*request.location, ReadOrigin(*edits->georeference)) : 0;
      if (distance_m < kNear_m + request.accuracy_m.value_or(0))
        near.emplace_back(distance_m, stored.name);
    } catch (const InputError&) {  // the document cannot be read
    }
  }
  std::ranges::sort(near);
  std::vector<std::string> names;
  for (auto& [distance_m, name] : near) names.push_back(std::move(name));
  return names;
}

// Nothing where the map cannot be used now, or its georeference does not fit it.
std::optional<PlacedMap> Placed(ServiceState& state, const std::string& name) {
  try {
    const auto map = state.shelf.Get(name);
    if (!map) return std::nullopt;
    const auto georeference = GeoreferenceOf(map->saved().map, *state.shelf.Edits(name));
    return georeference ? std::optional<PlacedMap>({map, *georeference}) : std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

// As a file, which is how images come everywhere else.
std::string FileOf(const GeoPoseImage& image) {
  if (image.format == GeoPoseImage::Format::kFile) return image.bytes;
  const bool is_grey = image.format == GeoPoseImage::Format::kGray8;
  const cv::Mat pixels(image.height, image.width, is_grey ? CV_8UC1 : CV_8UC4,
                       const_cast<char*>(image.bytes.data()));
  cv::Mat stored = pixels;
  if (!is_grey) cv::cvtColor(pixels, stored, cv::COLOR_RGBA2BGR);
  std::vector<uchar> file;
  cv::imencode(".png", stored, file);
  return {file.begin(), file.end()};
}

// The median distance of the landmarks that the nearest keyframe sees, map units.
double DepthAt(const Map& map, const Eigen::Vector3d& place) {
  const Keyframe* nearest = map.keyframes.Find(map.NearestKeyframe(place));
  std::vector<double> distances;
  if (nearest)
    for (const LandmarkId id : nearest->landmarks)
      if (const Landmark* landmark = id.IsValid() ? map.landmarks.Find(id) : nullptr)
        distances.push_back((landmark->position - place).norm());
  return distances.empty() ? 1 : Median(std::move(distances));
}

}  // namespace

GeoPoseReply AnswerGeoPose(ServiceState& state, const std::string& body) {
  const GeoPoseRequest request = ReadGeoPoseRequest(body, kMostGeoPoseImages);
  std::string why_not = "no map with a georeference is near";
  size_t asked_maps = 0;
  for (const std::string& name : MapsNear(state, request)) {
    const std::optional<PlacedMap> placed = Placed(state, name);
    if (!placed) continue;
    if (++asked_maps > kMostGeoPoseMaps) break;
    for (const GeoPoseImage& image : request.images) {
      ImageRequest asked;
      asked.bytes = FileOf(image);
      asked.camera.is_auto = !image.camera;
      if (image.camera) asked.camera.camera = *image.camera;
      const RelocalizationResult found =
          Localize(state, *placed->map, asked, RelocalizationMode::kPointsAndObjects).result;
      if (!found.world_from_cam) {
        why_not = found.why_not;
        continue;
      }
      const double depth = DepthAt(placed->map->saved().map, found.world_from_cam->translation);
      return {200, WriteGeoPoseAnswer(
                       {request.id, image.time_ms,
                        GeoPoseOfCamera(placed->georeference, *found.world_from_cam),
                        found.sigma_position * placed->georeference.enu_from_map.scale,
                        std::atan2(found.sigma_position, depth) * 180 / std::numbers::pi})};
    }
  }
  return {404, JsonText(JsonOfError(why_not))};
}

}  // namespace oaslam
