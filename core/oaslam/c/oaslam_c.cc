#include "oaslam/oaslam_c.h"

#include <cstring>
#include <utility>

#include "oaslam/c/handles.h"
#include "oaslam/c/values.h"
#include "oaslam/camera_file.h"
#include "oaslam/config_file.h"
#include "oaslam/log.h"

using namespace oaslam;     // NOLINT: all below are functions of C
using namespace oaslam::c;  // NOLINT

const char* oaslam_error() { return ErrorOfThread().c_str(); }

oaslam_status oaslam_set_log_sink(oaslam_log_sink sink, void* context) {
  return Call([&] {
    if (!sink) return SetLogSink({});
    SetLogSink([sink, context](LogLevel level, const std::string& message) {
      sink(context, static_cast<oaslam_log_level>(level), message.c_str());
    });
  });
}

oaslam_status oaslam_camera_load(const char* spec, int32_t width, int32_t height,
                                 oaslam_camera* camera) {
  return Call([&] { *camera = CameraOf(LoadCamera(spec, {width, height})); }, spec, camera);
}

oaslam_status oaslam_camera_project(const oaslam_camera* camera, const double in_cam[3],
                                    double pixel[2], int32_t* is_seen) {
  return Call(
      [&] {
        const auto found = CameraOf(*camera).Project(Eigen::Vector3d(in_cam));
        *is_seen = found.has_value();
        if (found) std::copy_n(found->data(), 2, pixel);
      },
      camera, in_cam, pixel, is_seen);
}

oaslam_status oaslam_camera_lift(const oaslam_camera* camera, const double pixel[2], double ray[3],
                                 int32_t* is_known) {
  return Call(
      [&] {
        const auto found = CameraOf(*camera).Lift(Eigen::Vector2d(pixel));
        *is_known = found.has_value();
        if (found) std::copy_n(found->data(), 3, ray);
      },
      camera, pixel, ray, is_known);
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
  return Call(
      [&] {
        if (config != OASLAM_LIVE && config != OASLAM_OFFLINE)
          throw InputError("config: " + std::to_string(config) + ", allowed: 0, 1");
        SlamConfig chosen = config == OASLAM_LIVE ? SlamConfig::Live() : SlamConfig::Offline();
        if (settings) LoadConfig(settings, chosen);
        *slam = new oaslam_slam{Slam(chosen, CameraOf(*camera))};
      },
      camera, slam);
}

void oaslam_slam_destroy(oaslam_slam* slam) { delete slam; }

oaslam_status oaslam_slam_process(oaslam_slam* slam, const oaslam_image* image,
                                  oaslam_result* result) {
  return Call([&] { *result = ResultOf(slam->slam.Process(InputOf(*image))); }, slam, image,
              result);
}

oaslam_status oaslam_slam_add_detections(oaslam_slam* slam, int32_t frame,
                                         const oaslam_detection* detections, size_t count,
                                         int32_t* objects) {
  return Call(
      [&] {
        const auto seen =
            slam->slam.AddDetections(frame, VectorOf<Detection>(detections, count, DetectionOf));
        if (objects) *objects = seen.value_or(-1);
      },
      slam);
}

oaslam_status oaslam_slam_finish(oaslam_slam* slam) {
  return Call([&] { slam->slam.Finish(); }, slam);
}

oaslam_status oaslam_slam_reset(oaslam_slam* slam) {
  return Call([&] { slam->slam.Reset(); }, slam);
}

oaslam_status oaslam_slam_set_mapping(oaslam_slam* slam, int32_t is_on) {
  return Call([&] { slam->slam.SetMapping(is_on != 0); }, slam);
}

oaslam_status oaslam_slam_set_relocalization_mode(oaslam_slam* slam,
                                                  oaslam_relocalization_mode mode) {
  return Call([&] { slam->slam.SetRelocalizationMode(static_cast<RelocalizationMode>(mode)); },
              slam);
}

oaslam_status oaslam_slam_force_relocalization(oaslam_slam* slam, const oaslam_pose* near) {
  return Call([&] { slam->slam.ForceRelocalization(PoseOf(near)); }, slam);
}

oaslam_status oaslam_slam_set_mask(oaslam_slam* slam, const uint8_t* pixels, int32_t width,
                                   int32_t height, size_t bytes_per_row) {
  return Call(
      [&] {
        slam->slam.SetMask(pixels ? PixelsOf(pixels, width, height, 1, bytes_per_row) : cv::Mat());
      },
      slam);
}

oaslam_status oaslam_slam_set_imu(oaslam_slam* slam, const oaslam_pose* cam_from_imu) {
  return Call([&] { slam->slam.SetImu(*PoseOf(cam_from_imu)); }, slam, cam_from_imu);
}

oaslam_status oaslam_slam_imu(const oaslam_slam* slam, oaslam_imu_calibration* imu) {
  return Call([&] { *imu = CalibrationOf(slam->slam.Imu()); }, slam, imu);
}

oaslam_status oaslam_slam_set_class_names(oaslam_slam* slam, const oaslam_class_name* names,
                                          size_t count) {
  return Call(
      [&] {
        std::map<int, std::string> by_category;
        for (size_t i = 0; i < count; ++i)
          by_category[names[i].category_id] = TextOf(names[i].name);
        slam->slam.SetClassNames(std::move(by_category));
      },
      slam, names);
}

oaslam_status oaslam_slam_set_class_relations(oaslam_slam* slam, const oaslam_class_part* parts,
                                              size_t part_count, const int32_t* movable,
                                              size_t movable_count) {
  return Call(
      [&] {
        ClassRelations relations;
        for (const auto& [part, whole] : VectorOf<std::pair<int, int>>(
                 parts, part_count,
                 [](const oaslam_class_part& p) { return std::pair<int, int>(p.part, p.whole); }))
          relations.whole_of[part] = whole;
        for (const int category :
             VectorOf<int>(movable, movable_count, [](int32_t id) { return id; }))
          relations.movable.insert(category);
        slam->slam.SetClassRelations(relations);
      },
      slam);
}

oaslam_status oaslam_slam_name_recording(oaslam_slam* slam, const char* name, const char* images) {
  return Call([&] { slam->slam.NameRecording(name, TextOf(images)); }, slam, name);
}

oaslam_status oaslam_slam_set_metres_per_unit(oaslam_slam* slam, double metres) {
  return Call([&] { slam->slam.SetMetresPerUnit(metres); }, slam);
}

oaslam_status oaslam_slam_set_scale(oaslam_slam* slam, const oaslam_scale_estimate* estimate) {
  return Call(
      [&] {
        ScaleEstimate scale;
        scale.success = true;
        scale.metres_per_unit = estimate->metres_per_unit;
        scale.relative_sigma = estimate->relative_sigma;
        scale.objects = estimate->objects;
        scale.classes = estimate->classes;
        slam->slam.SetMetresPerUnit(scale);
      },
      slam, estimate);
}

oaslam_status oaslam_slam_save(const oaslam_slam* slam, const char* path) {
  return Call([&] { slam->slam.Save(path); }, slam, path);
}

oaslam_status oaslam_slam_load(oaslam_slam* slam, const char* path) {
  return Call([&] { slam->slam.Load(path); }, slam, path);
}

oaslam_status oaslam_slam_load_map(oaslam_slam* slam, const oaslam_map* map) {
  return Call([&] { slam->slam.Load(map->map); }, slam, map);
}

oaslam_status oaslam_slam_map(const oaslam_slam* slam, oaslam_map** map) {
  return Call([&] { *map = new oaslam_map(slam->slam.Snapshot()); }, slam, map);
}

oaslam_status oaslam_slam_whole_map(const oaslam_slam* slam, oaslam_map** map) {
  return Call([&] { *map = new oaslam_map(slam->slam.WholeMap()); }, slam, map);
}

oaslam_status oaslam_slam_trajectory(const oaslam_slam* slam, oaslam_stamped_pose* poses,
                                     size_t most, size_t* count) {
  return Call([&] { WriteOrCount(slam->slam.Trajectory(), poses, most, count, StampedPoseOf); },
              slam, count);
}

oaslam_status oaslam_slam_tracked_points(const oaslam_slam* slam, oaslam_tracked_point* points,
                                         size_t most, size_t* count) {
  return Call(
      [&] { WriteOrCount(slam->slam.TrackedPoints(), points, most, count, TrackedPointOf); }, slam,
      count);
}

oaslam_status oaslam_slam_former_worlds(const oaslam_slam* slam, oaslam_former_world* worlds,
                                        size_t most, size_t* count) {
  return Call(
      [&] {
        WriteOrCount(slam->slam.FormerWorlds(), worlds, most, count,
                     [](const FormerWorld& w) -> oaslam_former_world {
                       return {w.world.value, w.scale};
                     });
      },
      slam, count);
}

oaslam_status oaslam_slam_presence(const oaslam_slam* slam, oaslam_object_presence* objects,
                                   size_t most, size_t* count) {
  return Call([&] { WriteOrCount(slam->slam.Presence(), objects, most, count, PresenceOf); }, slam,
              count);
}

oaslam_status oaslam_slam_events(const oaslam_slam* slam, uint64_t after, oaslam_event* events,
                                 size_t most, size_t* count) {
  return Call([&] { Write(slam->slam.States().EventsAfter(after), events, most, count, EventOf); },
              slam, count);
}

oaslam_status oaslam_slam_edit_object(oaslam_slam* slam, uint32_t object,
                                      const oaslam_object_edit* edit) {
  return Call([&] { slam->slam.EditObject(ObjectId(object), EditOf(*edit)); }, slam, edit);
}

oaslam_status oaslam_slam_cast(const oaslam_slam* slam, const double pixel[2], oaslam_ray_hit* hits,
                               size_t most, size_t* count) {
  return Call(
      [&] {
        Write(slam->slam.Cast({pixel[0], pixel[1]}), hits, most, count, HitOf);
      },
      slam, pixel, count);
}

oaslam_status oaslam_slam_place_anchor(oaslam_slam* slam, const oaslam_anchor_request* request,
                                       char name[OASLAM_NAME_SIZE]) {
  return Call(
      [&] {
        AnchorRequest asked;
        asked.name = TextOf(request->name);
        asked.model = TextOf(request->model);
        if (request->is_at_pixel)
          asked.pixel = Eigen::Vector2d(request->pixel[0], request->pixel[1]);
        asked.origin = PointOf(request->origin);
        asked.direction = PointOf(request->direction);
        if (request->is_on_object) asked.object = ObjectId(request->object);
        asked.size = request->size;
        asked.pose = PoseOf(request->pose);
        const AnchorReport report = slam->slam.PlaceAnchor(asked);
        if (name && report.IsDone()) std::strncpy(name, report.name.c_str(), OASLAM_NAME_SIZE);
        return StatusOf(report);
      },
      slam, request);
}

oaslam_status oaslam_slam_edit_anchor(oaslam_slam* slam, const char* name,
                                      const oaslam_anchor_edit* edit) {
  return Call(
      [&] {
        AnchorEdit asked;
        if (edit->name) asked.name = edit->name;
        if (edit->model) asked.model = edit->model;
        if (edit->size != 0) asked.size = edit->size;
        asked.turn_rad = edit->turn_rad;
        asked.pose = PoseOf(edit->pose);
        return StatusOf(slam->slam.EditAnchor(name, asked));
      },
      slam, name, edit);
}

oaslam_status oaslam_slam_remove_anchor(oaslam_slam* slam, const char* name) {
  return Call([&] { return StatusOf(slam->slam.RemoveAnchor(name)); }, slam, name);
}

oaslam_status oaslam_slam_relocalize(oaslam_slam* slam, const oaslam_image* image,
                                     const oaslam_relocalize_options* options,
                                     oaslam_relocalization* found) {
  return Call(
      [&] {
        const auto result = slam->slam.Relocalize(InputOf(*image), OptionsOf(options));
        *found = RelocalizationOf(result);
        return Failed(OASLAM_OK, result.why_not.c_str());
      },
      slam, image, found);
}
