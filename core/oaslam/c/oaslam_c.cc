#include "oaslam/oaslam_c.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <iterator>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/camera_file.h"
#include "oaslam/config_file.h"
#include "oaslam/error.h"
#include "oaslam/map_localizer.h"
#include "oaslam/slam.h"

struct oaslam_slam {
  oaslam::Slam slam;
};
struct oaslam_localizer {
  oaslam::MapLocalizer localizer;
};
struct oaslam_map {
  explicit oaslam_map(oaslam::MapSnapshot content) : map(std::move(content)) {}

  oaslam::MapSnapshot map;
  // Arrays are made when they are first asked for, by whichever thread.
  std::once_flag has_objects, has_anchors, has_landmarks, has_keyframes;
  std::vector<oaslam::MapSnapshot::Object> named_objects;
  std::vector<oaslam::AnchorPose> named_anchors;
  std::vector<oaslam_object> objects;
  std::vector<oaslam_anchor> anchors;
  std::vector<oaslam_landmark> landmarks;
  std::vector<oaslam_keyframe> keyframes;
  std::string bytes;
};

static_assert(OASLAM_PRELIMINARY == static_cast<int>(oaslam::TrackingState::kPreliminary));
static_assert(OASLAM_LOST == static_cast<int>(oaslam::TrackingState::kLost));
static_assert(OASLAM_FROM_REGISTRATION == static_cast<int>(oaslam::PoseSource::kRegistration));
static_assert(OASLAM_FOUND_BY_BOTH == static_cast<int>(oaslam::PoseEvidence::kPointsAndObjects));
static_assert(OASLAM_USE_BOTH == static_cast<int>(oaslam::RelocalizationMode::kPointsAndObjects));

namespace oaslam {
namespace {

std::string& ErrorOfThread() {
  thread_local std::string error;
  return error;
}

// Without the memory for a text the old one stays.
oaslam_status Failed(oaslam_status status, const char* what) noexcept {
  try {
    ErrorOfThread() = what;
  } catch (...) {
  }
  return status;
}

template <typename Function>
oaslam_status Guarded(Function&& function) noexcept {
  try {
    return function();
  } catch (const InputError& error) {
    return Failed(OASLAM_INPUT_ERROR, error.what());
  } catch (const MappingError& error) {
    return Failed(OASLAM_MAPPING_ERROR, error.what());
  } catch (const std::exception& error) {
    return Failed(OASLAM_OTHER_ERROR, error.what());
  } catch (...) {
    return Failed(OASLAM_OTHER_ERROR, "unknown error");
  }
}

template <typename... Pointer>
void ExpectNoNull(const Pointer*... pointers) {
  if (((pointers == nullptr) || ...)) throw InputError("an argument that is needed is NULL");
}

Eigen::Vector3d VectorOf(const double (&numbers)[3]) {
  return {numbers[0], numbers[1], numbers[2]};
}

template <typename Vector, size_t kSize>
void Copy(const Vector& from, double (&to)[kSize]) {
  for (size_t i = 0; i < kSize; ++i) to[i] = from[static_cast<Eigen::Index>(i)];
}

oaslam_pose PoseOf(const Rigid3& pose) {
  oaslam_pose c{};
  Copy(pose.translation, c.translation);
  Copy(pose.rotation.coeffs(), c.rotation);
  return c;
}

std::optional<Rigid3> PoseOf(const oaslam_pose* pose) {
  if (!pose) return std::nullopt;
  const auto& [x, y, z, w] = pose->rotation;
  return Rigid3(Rigid3::Rotation(w, x, y, z), VectorOf(pose->translation));
}

Camera CameraOf(const oaslam_camera& c) {
  Camera camera;
  camera.model = c.is_fisheye ? LensModel::kFisheye : LensModel::kPinhole;
  camera.width = c.width, camera.height = c.height;
  camera.fx = c.fx, camera.fy = c.fy, camera.cx = c.cx, camera.cy = c.cy;
  for (size_t i = 0; i < camera.distortion.size(); ++i) camera.distortion[i] = c.distortion[i];
  return camera;
}

oaslam_camera CameraOf(const Camera& camera) {
  oaslam_camera c{};
  c.is_fisheye = camera.model == LensModel::kFisheye;
  c.width = camera.width, c.height = camera.height;
  c.fx = camera.fx, c.fy = camera.fy, c.cx = camera.cx, c.cy = camera.cy;
  for (size_t i = 0; i < camera.distortion.size(); ++i) c.distortion[i] = camera.distortion[i];
  return c;
}

ImageInput InputOf(const oaslam_image& image) {
  ImageInput input;
  input.timestamp = image.timestamp;
  if (image.pixels) {
    const int channels = image.channels;
    if (channels != 1 && channels != 3 && channels != 4)
      throw InputError("channels: " + std::to_string(channels) + ", allowed: 1, 3, 4");
    if (image.width <= 0 || image.height <= 0 ||
        image.bytes_per_row < static_cast<size_t>(image.width) * static_cast<size_t>(channels))
      throw InputError("image: width and height must be above 0, and bytes_per_row hold a row");
    input.image = cv::Mat(image.height, image.width, CV_8UC(channels),
                          const_cast<uint8_t*>(image.pixels), image.bytes_per_row);
  }
  if (image.detection_count > 0) ExpectNoNull(image.detections);
  for (size_t i = 0; i < image.detection_count; ++i) {
    const oaslam_detection& d = image.detections[i];
    input.detections.push_back(
        {.category_id = d.category_id, .score = d.score, .box = {d.x1, d.y1, d.x2, d.y2}});
  }
  if (image.gravity_in_cam)
    input.gravity_in_cam = Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(image.gravity_in_cam));
  return input;
}

oaslam_result ResultOf(const TrackingResult& r) {
  oaslam_result c{};
  c.frame = r.frame;
  c.timestamp = r.timestamp;
  c.state = static_cast<oaslam_state>(r.state);
  c.source = static_cast<oaslam_source>(r.source);
  c.world = r.world.value;
  c.is_uncertain = r.is_uncertain;
  c.confidence = r.confidence;
  c.seconds_without_map = r.seconds_without_map;
  c.depth = r.depth;
  for (int i = 0; i < 36; ++i) c.covariance[i] = r.covariance(i / 6, i % 6);
  c.matched = r.matched.value_or(-1);
  c.inliers = r.inliers.value_or(-1);
  c.detections = r.detections;
  c.objects = r.objects;
  if (const std::optional<Rigid3> pose = r.PoseIn(r.world)) {
    c.reserved.has_pose = 1;
    c.reserved.pose = PoseOf(*pose);
  }
  const size_t count = std::min(std::size(c.elsewhere), r.elsewhere.size());
  c.elsewhere_count = static_cast<int32_t>(count);
  for (size_t i = 0; i < count; ++i) {
    const PoseElsewhere& there = r.elsewhere[r.elsewhere.size() - count + i];
    c.elsewhere[i] = there.world.value;
    c.reserved.elsewhere[i] = PoseOf(there.world_from_cam);
  }
  return c;
}

RelocalizeOptions OptionsOf(const oaslam_relocalize_options* c) {
  if (!c) return {};
  RelocalizeOptions options;
  options.mode = static_cast<RelocalizationMode>(c->mode);
  options.prior = PoseOf(c->prior);
  if (c->camera) options.camera = CameraOf(*c->camera);
  options.unknown_camera = c->unknown_camera != 0;
  options.follow = c->follow != 0;
  return options;
}

template <typename Map>
oaslam_status Relocalize(Map& map, const oaslam_image& image,
                         const oaslam_relocalize_options* options, oaslam_relocalization& found) {
  const RelocalizationResult r = map.Relocalize(InputOf(image), OptionsOf(options));
  found = {};
  found.evidence = static_cast<oaslam_evidence>(r.evidence);
  found.world = r.world.value;
  if (r.world_from_cam) found.world_from_cam = PoseOf(*r.world_from_cam);
  found.confidence = r.confidence;
  found.sigma_position = r.sigma_position;
  found.inlier_points = r.inlier_points;
  found.matched_objects = r.matched_objects;
  if (r.camera) {
    found.has_camera = 1;
    found.camera = CameraOf(*r.camera);
  }
  return Failed(OASLAM_OK, r.why_not.c_str());
}

std::string TextOf(const char* text) { return text ? text : ""; }

oaslam_status StatusOf(const AnchorReport& report) {
  return report.IsDone() ? OASLAM_OK : Failed(OASLAM_REFUSED, report.why_not.c_str());
}

// An array of a map, made by fill(map) with the first call. Null where memory runs out.
template <typename Element, typename Fill>
const Element* Array(const oaslam_map* handle, std::once_flag oaslam_map::*flag,
                     std::vector<Element> oaslam_map::*array, size_t* count, Fill&& fill) noexcept {
  if (count) *count = 0;
  if (!handle) return nullptr;
  auto& map = const_cast<oaslam_map&>(*handle);  // all handles are made by us, and not const
  const oaslam_status status = Guarded([&] {
    std::call_once(map.*flag, [&] { fill(map); });
    return OASLAM_OK;
  });
  const std::vector<Element>& made = map.*array;
  if (status != OASLAM_OK || made.empty()) return nullptr;
  if (count) *count = made.size();
  return made.data();
}

oaslam_object ObjectOf(const MapSnapshot::Object& o) {
  oaslam_object c{};
  c.id = o.id.value;
  c.category_id = o.category_id;
  c.name = o.name.c_str();
  Copy(o.ellipsoid.center, c.center);
  Copy(o.ellipsoid.half_axes, c.half_axes);
  Copy(o.ellipsoid.rotation.coeffs(), c.rotation);
  c.observations = o.observations;
  c.has_moved = o.has_moved;
  return c;
}

// Returns how many were written.
size_t WriteHits(const std::vector<oaslam::RayHit>& found, oaslam_ray_hit* hits, size_t most) {
  const size_t count = hits ? std::min(most, found.size()) : 0;
  for (size_t i = 0; i < count; ++i) {
    const oaslam::RayHit& hit = found[i];
    hits[i].kind = static_cast<oaslam_hit_kind>(hit.kind);
    hits[i].id = hit.object ? hit.object->value : hit.landmark ? hit.landmark->value : 0;
    hits[i].distance = hit.distance;
    Copy(hit.position, hits[i].position);
    Copy(hit.normal, hits[i].normal);
  }
  return count;
}

oaslam_anchor AnchorOf(const AnchorPose& a) {
  oaslam_anchor c{};
  c.name = a.name.c_str();
  c.model = a.model.c_str();
  c.size = a.size;
  c.world_from_anchor = PoseOf(a.world_from_anchor);
  c.is_on_object = a.object.has_value();
  if (a.object) c.object = a.object->value;
  return c;
}

}  // namespace
}  // namespace oaslam

using namespace oaslam;  // NOLINT: all below are functions of C

const char* oaslam_error() { return ErrorOfThread().c_str(); }

oaslam_status oaslam_camera_load(const char* spec, int32_t width, int32_t height,
                                 oaslam_camera* camera) {
  return Guarded([&] {
    ExpectNoNull(spec, camera);
    *camera = CameraOf(LoadCamera(spec, {width, height}));
    return OASLAM_OK;
  });
}

oaslam_status oaslam_camera_project(const oaslam_camera* camera, const double in_cam[3],
                                    double pixel[2], int32_t* is_seen) {
  return Guarded([&] {
    ExpectNoNull(camera, in_cam, pixel, is_seen);
    const auto found = CameraOf(*camera).Project(Eigen::Map<const Eigen::Vector3d>(in_cam));
    *is_seen = found.has_value();
    if (found) std::copy_n(found->data(), 2, pixel);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_camera_lift(const oaslam_camera* camera, const double pixel[2], double ray[3],
                                 int32_t* is_known) {
  return Guarded([&] {
    ExpectNoNull(camera, pixel, ray, is_known);
    const auto found = CameraOf(*camera).Lift(Eigen::Map<const Eigen::Vector2d>(pixel));
    *is_known = found.has_value();
    if (found) std::copy_n(found->data(), 3, ray);
    return OASLAM_OK;
  });
}

int32_t oaslam_pose_in(const oaslam_result* result, uint32_t world, oaslam_pose* pose) {
  if (!result || !pose) return 0;
  if (result->world == world) {
    if (result->reserved.has_pose) *pose = result->reserved.pose;
    return result->reserved.has_pose;
  }
  for (int32_t i = 0; i < result->elsewhere_count; ++i)
    if (result->elsewhere[i] == world) {
      *pose = result->reserved.elsewhere[i];
      return 1;
    }
  return 0;
}

oaslam_status oaslam_slam_create(oaslam_config config, const char* settings,
                                 const oaslam_camera* camera, oaslam_slam** slam) {
  return Guarded([&] {
    ExpectNoNull(camera, slam);
    SlamConfig chosen = config == OASLAM_LIVE ? SlamConfig::Live() : SlamConfig::Offline();
    if (settings) LoadConfig(settings, chosen);
    *slam = new oaslam_slam{Slam(chosen, CameraOf(*camera))};
    return OASLAM_OK;
  });
}

void oaslam_slam_destroy(oaslam_slam* slam) { delete slam; }

oaslam_status oaslam_slam_process(oaslam_slam* slam, const oaslam_image* image,
                                  oaslam_result* result) {
  return Guarded([&] {
    ExpectNoNull(slam, image, result);
    *result = ResultOf(slam->slam.Process(InputOf(*image)));
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_finish(oaslam_slam* slam) {
  return Guarded([&] {
    ExpectNoNull(slam);
    slam->slam.Finish();
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_reset(oaslam_slam* slam) {
  return Guarded([&] {
    ExpectNoNull(slam);
    slam->slam.Reset();
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_set_mapping(oaslam_slam* slam, int32_t is_on) {
  return Guarded([&] {
    ExpectNoNull(slam);
    slam->slam.SetMapping(is_on != 0);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_set_metres_per_unit(oaslam_slam* slam, double metres) {
  return Guarded([&] {
    ExpectNoNull(slam);
    slam->slam.SetMetresPerUnit(metres);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_set_scale(oaslam_slam* slam, const oaslam_scale_estimate* estimate) {
  return Guarded([&] {
    ExpectNoNull(slam, estimate);
    ScaleEstimate scale;
    scale.success = true;
    scale.metres_per_unit = estimate->metres_per_unit;
    scale.relative_sigma = estimate->relative_sigma;
    scale.objects = estimate->objects;
    scale.classes = estimate->classes;
    slam->slam.SetMetresPerUnit(scale);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_save(const oaslam_slam* slam, const char* path) {
  return Guarded([&] {
    ExpectNoNull(slam, path);
    slam->slam.Save(path);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_load(oaslam_slam* slam, const char* path) {
  return Guarded([&] {
    ExpectNoNull(slam, path);
    slam->slam.Load(path);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_cast(const oaslam_slam* slam, const double pixel[2], oaslam_ray_hit* hits,
                               size_t most, size_t* count) {
  return Guarded([&] {
    ExpectNoNull(slam, pixel, count);
    *count = WriteHits(slam->slam.Cast({pixel[0], pixel[1]}), hits, most);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_map_cast(const oaslam_map* map, const double origin[3],
                              const double direction[3], oaslam_ray_hit* hits, size_t most,
                              size_t* count) {
  return Guarded([&] {
    ExpectNoNull(map, origin, direction, count);
    *count =
        WriteHits(map->map.Cast(Eigen::Vector3d(origin), Eigen::Vector3d(direction)), hits, most);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_slam_place_anchor(oaslam_slam* slam, const oaslam_anchor_request* request,
                                       char name[OASLAM_NAME_SIZE]) {
  return Guarded([&] {
    ExpectNoNull(slam, request);
    AnchorRequest asked;
    asked.name = TextOf(request->name);
    asked.model = TextOf(request->model);
    if (request->is_at_pixel) asked.pixel = Eigen::Vector2d(request->pixel[0], request->pixel[1]);
    asked.origin = VectorOf(request->origin);
    asked.direction = VectorOf(request->direction);
    if (request->is_on_object) asked.object = ObjectId(request->object);
    asked.size = request->size;
    asked.pose = PoseOf(request->pose);
    const AnchorReport report = slam->slam.PlaceAnchor(asked);
    if (name && report.IsDone()) std::strncpy(name, report.name.c_str(), OASLAM_NAME_SIZE);
    return StatusOf(report);
  });
}

oaslam_status oaslam_slam_edit_anchor(oaslam_slam* slam, const char* name,
                                      const oaslam_anchor_edit* edit) {
  return Guarded([&] {
    ExpectNoNull(slam, name, edit);
    AnchorEdit asked;
    if (edit->name) asked.name = edit->name;
    if (edit->model) asked.model = edit->model;
    if (edit->size != 0) asked.size = edit->size;
    asked.turn_rad = edit->turn_rad;
    asked.pose = PoseOf(edit->pose);
    return StatusOf(slam->slam.EditAnchor(name, asked));
  });
}

oaslam_status oaslam_slam_remove_anchor(oaslam_slam* slam, const char* name) {
  return Guarded([&] {
    ExpectNoNull(slam, name);
    return StatusOf(slam->slam.RemoveAnchor(name));
  });
}

oaslam_status oaslam_slam_map(const oaslam_slam* slam, oaslam_map** map) {
  return Guarded([&] {
    ExpectNoNull(slam, map);
    *map = new oaslam_map(slam->slam.Snapshot());
    return OASLAM_OK;
  });
}

oaslam_status oaslam_map_load(const char* path, oaslam_map** map) {
  return Guarded([&] {
    ExpectNoNull(path, map);
    *map = new oaslam_map(MapSnapshot::Load(path));
    return OASLAM_OK;
  });
}

void oaslam_map_destroy(oaslam_map* map) { delete map; }

oaslam_status oaslam_map_save(const oaslam_map* map, const char* path) {
  return Guarded([&] {
    ExpectNoNull(map, path);
    map->map.Save(path);
    return OASLAM_OK;
  });
}

oaslam_status oaslam_map_to_bytes(oaslam_map* map, const uint8_t** bytes, size_t* count) {
  return Guarded([&] {
    ExpectNoNull(map, bytes, count);
    map->bytes = map->map.ToBytes();
    *bytes = reinterpret_cast<const uint8_t*>(map->bytes.data());
    *count = map->bytes.size();
    return OASLAM_OK;
  });
}

oaslam_status oaslam_map_from_bytes(const uint8_t* bytes, size_t count, oaslam_map** map) {
  return Guarded([&] {
    ExpectNoNull(bytes, map);
    *map = new oaslam_map(MapSnapshot::FromBytes({reinterpret_cast<const char*>(bytes), count}));
    return OASLAM_OK;
  });
}

uint32_t oaslam_map_world(const oaslam_map* map) { return map ? map->map.world().value : 0; }

int32_t oaslam_map_is_metric(const oaslam_map* map) { return map && map->map.is_metric(); }

double oaslam_map_unit_sigma(const oaslam_map* map) { return map ? map->map.unit_sigma() : 0; }

oaslam_status oaslam_map_estimate_scale(const oaslam_map* map, oaslam_scale_estimate* estimate) {
  return Guarded([&] {
    ExpectNoNull(map, estimate);
    const ScaleEstimate scale = map->map.EstimateScale();
    if (!scale.success) return Failed(OASLAM_REFUSED, scale.why_not.c_str());
    *estimate = {scale.metres_per_unit, scale.relative_sigma, scale.objects, scale.classes};
    return OASLAM_OK;
  });
}

const oaslam_object* oaslam_map_objects(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_objects, &oaslam_map::objects, count, [](oaslam_map& m) {
    m.named_objects = m.map.Objects().ToVector();
    for (const MapSnapshot::Object& o : m.named_objects) m.objects.push_back(ObjectOf(o));
  });
}

const oaslam_anchor* oaslam_map_anchors(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_anchors, &oaslam_map::anchors, count, [](oaslam_map& m) {
    m.named_anchors = m.map.Anchors();
    for (const AnchorPose& a : m.named_anchors) m.anchors.push_back(AnchorOf(a));
  });
}

const oaslam_landmark* oaslam_map_landmarks(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_landmarks, &oaslam_map::landmarks, count, [](oaslam_map& m) {
    for (const MapSnapshot::Landmark& l : m.map.Landmarks())
      m.landmarks.push_back(
          {l.id.value, {l.position.x(), l.position.y(), l.position.z()}, l.observations});
  });
}

const oaslam_keyframe* oaslam_map_keyframes(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_keyframes, &oaslam_map::keyframes, count, [](oaslam_map& m) {
    for (const MapSnapshot::Keyframe& k : m.map.Keyframes())
      m.keyframes.push_back({k.id.value, k.timestamp, PoseOf(k.world_from_cam)});
  });
}

oaslam_status oaslam_slam_relocalize(oaslam_slam* slam, const oaslam_image* image,
                                     const oaslam_relocalize_options* options,
                                     oaslam_relocalization* found) {
  return Guarded([&] {
    ExpectNoNull(slam, image, found);
    return Relocalize(slam->slam, *image, options, *found);
  });
}

oaslam_status oaslam_localizer_create(const oaslam_map* map, oaslam_localizer** localizer) {
  return Guarded([&] {
    ExpectNoNull(map, localizer);
    *localizer = new oaslam_localizer{MapLocalizer(map->map)};
    return OASLAM_OK;
  });
}

void oaslam_localizer_destroy(oaslam_localizer* localizer) { delete localizer; }

oaslam_status oaslam_localizer_relocalize(const oaslam_localizer* localizer,
                                          const oaslam_image* image,
                                          const oaslam_relocalize_options* options,
                                          oaslam_relocalization* found) {
  return Guarded([&] {
    ExpectNoNull(localizer, image, found);
    return Relocalize(localizer->localizer, *image, options, *found);
  });
}
