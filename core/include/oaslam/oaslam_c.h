#ifndef OASLAM_OASLAM_C_H_
#define OASLAM_OASLAM_C_H_

/* The library for C and all that can call C (Swift, C#, Rust, Unity). What a function means, its
 * frames and units are those of the C++ function that it is named after: oaslam_slam_process is
 * oaslam::Slam::Process. docs/c.md has an example.
 *
 * Handles. A function with an output argument such as `oaslam_map** map` makes a handle;
 * *_destroy frees a handle, and accepts NULL. A handle of a Slam is for one thread at a time;
 * those of maps and localizers are for any number.
 *
 * Errors. No exception leaves the library. A function returns OASLAM_OK, or tells what went wrong
 * and changes nothing; oaslam_error says it in words. What a function writes is written only with
 * OASLAM_OK.
 *
 * Memory. What is passed in is read until the call returns, and copied if it is kept. Text and
 * arrays of a handle live as long as the handle. */

#include <stddef.h>
#include <stdint.h>

#include "oaslam/export.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
  OASLAM_OK = 0,
  OASLAM_INPUT_ERROR = 1,   /* an argument, image or file cannot be used */
  OASLAM_MAPPING_ERROR = 2, /* mapping has ended; the map can still be saved */
  OASLAM_REFUSED = 3,       /* no place for an anchor, no known scale, maps that do not match */
  OASLAM_OTHER_ERROR = 4,   /* e.g. memory ran out */
  OASLAM_FORK_ERROR = 5     /* the handle is of the process that was forked; make one here */
} oaslam_status;

/* The message of this thread's last call that did not return OASLAM_OK, or of its last relocalize
 * call: why the image was not found. It lives until the thread's next such call. */
OASLAM_API const char* oaslam_error(void);

/* The numbers of oaslam::LogLevel. */
typedef enum { OASLAM_LOG_DEBUG = 0, OASLAM_LOG_INFO = 1, OASLAM_LOG_WARNING = 2 } oaslam_log_level;
/* Receives a message, which lives until the function returns, on the thread that logs it; several
 * threads may call it at once. */
typedef void (*oaslam_log_sink)(void* context, oaslam_log_level level, const char* message);
/* Sets where all messages of the library in this program go; NULL drops them. By default warnings
 * go to the standard error stream and the rest is dropped. */
OASLAM_API oaslam_status oaslam_set_log_sink(oaslam_log_sink sink, void* context);

/* The numbers of oaslam::TrackingState, PoseSource, PoseEvidence and RelocalizationMode. */
typedef enum {
  OASLAM_INITIALIZING = 0,
  OASLAM_TRACKING = 1,
  OASLAM_RELOCALIZED = 2,
  OASLAM_BY_OBJECTS = 3,
  OASLAM_LOST = 4,
  OASLAM_ODOMETRY = 5,
  OASLAM_PRELIMINARY = 6
} oaslam_state;
typedef enum {
  OASLAM_FROM_NOTHING = 0,
  OASLAM_FROM_MAP = 1,
  OASLAM_FROM_MOTION = 2,
  OASLAM_FROM_OBJECTS = 3,
  OASLAM_FROM_REGISTRATION = 4
} oaslam_source;
typedef enum {
  OASLAM_NOT_FOUND = 0,
  OASLAM_FOUND_BY_POINTS = 1,
  OASLAM_FOUND_BY_OBJECTS = 2,
  OASLAM_FOUND_BY_BOTH = 3
} oaslam_evidence;
typedef enum {
  OASLAM_USE_POINTS = 0,
  OASLAM_USE_OBJECTS = 1,
  OASLAM_USE_BOTH = 2
} oaslam_relocalization_mode;

/* Camera to world, or anchor to world: x_in_world = rotation * x + translation; a unit quaternion
 * x, y, z, w. */
typedef struct {
  double translation[3];
  double rotation[4];
} oaslam_pose;

/* --- The camera ------------------------------------------------------------------------------ */

/* oaslam::Camera: x right, y down, z forward; the centre of the upper left pixel is (0, 0). */
typedef struct {
  int32_t is_fisheye; /* distortion k1 k2 k3 k4; else k1 k2 p1 p2 k3, zeros for none */
  int32_t width, height;
  double fx, fy, cx, cy;
  double distortion[5];
} oaslam_camera;

/* A calibration file or "fov:DEGREES", for images of this size. */
OASLAM_API oaslam_status oaslam_camera_load(const char* spec, int32_t width, int32_t height,
                                            oaslam_camera* camera);
/* `is_seen` becomes 0, and the pixel is not written, where the camera cannot show the point. */
OASLAM_API oaslam_status oaslam_camera_project(const oaslam_camera* camera, const double in_cam[3],
                                               double pixel[2], int32_t* is_seen);
/* The ray of a pixel, with z = 1; `is_known` becomes 0, and the ray is not written, where the
 * lens model has no ray for the pixel. */
OASLAM_API oaslam_status oaslam_camera_lift(const oaslam_camera* camera, const double pixel[2],
                                            double ray[3], int32_t* is_known);

/* --- Images ---------------------------------------------------------------------------------- */

typedef struct {
  int32_t category_id;
  double score;
  double x1, y1, x2, y2; /* edges, pixels of the image as it is given */
} oaslam_detection;

/* A sample of a gyroscope: oaslam::AngularVelocity. */
typedef struct {
  double timestamp;
  double in_cam[3]; /* rad/s */
} oaslam_angular_velocity;

/* A sample of an IMU, along its own axes: oaslam::ImuSample. */
typedef struct {
  double timestamp;
  double angular_velocity[3]; /* rad/s */
  double acceleration[3];     /* m/s^2; at rest 9.81 away from the ground */
} oaslam_imu_sample;

typedef struct {
  double pixel[2];
  double inverse_depth;
} oaslam_point_depth;
typedef struct {
  int32_t image;
  oaslam_pose odom_from_cam;
} oaslam_corrected_pose;
/* The camera's motion by another odometry: oaslam::MotionInput. */
typedef struct {
  int32_t is_known;
  int32_t run, image;
  oaslam_pose odom_from_cam;
  int32_t is_preliminary, is_keyframe;
  double agreeing; /* 0: not known, counts as 1 */
  const oaslam_point_depth* depths;
  size_t depth_count;
  const oaslam_corrected_pose* corrected;
  size_t corrected_count;
} oaslam_motion;

typedef struct {
  float pixel[2]; /* in the image without distortion */
  float angle_rad;
  uint8_t level;
  uint64_t descriptor[4];
} oaslam_feature;
/* Key points that were found elsewhere: oaslam::ImageFeatures. */
typedef struct {
  const oaslam_feature* features;
  size_t count;
  int32_t levels;              /* 0: 8 */
  double factor, lowest_pixel; /* 0: 1.2 and 1 */
} oaslam_features;

/* oaslam::ImageInput. Every field that the caller does not know may be zero. */
typedef struct {
  const uint8_t* pixels; /* NULL: boxes alone (relocalize only) */
  int32_t width, height;
  int32_t channels; /* 1 grey, 3 BGR, 4 BGRA */
  size_t bytes_per_row;
  double timestamp; /* seconds, ascending */
  const oaslam_detection* detections;
  size_t detection_count;
  const double* gravity_in_cam; /* three numbers; NULL: not measured */
  int32_t detections_follow;    /* by oaslam_slam_add_detections */
  const oaslam_angular_velocity* angular_velocity;
  size_t angular_velocity_count;
  const oaslam_motion* motion;     /* NULL: Slam's own odometry estimates it from the images */
  const oaslam_features* features; /* of an image without pixels; or NULL */
  const oaslam_imu_sample* imu;    /* instead of angular_velocity */
  size_t imu_count;
  /* The depth camera: oaslam::DepthImage. */
  const void* depth;      /* rows of uint16_t, or of float in metres; NULL: none */
  int32_t depth_is_float; /* whether it is float */
  int32_t depth_width, depth_height;
  size_t depth_bytes_per_row;
  double depth_unit;                 /* metres of a count; 0: 0.001 */
  const oaslam_camera* depth_camera; /* NULL: registered to the image */
  const oaslam_pose* cam_from_depth; /* of a depth camera that is not registered; NULL: none */
} oaslam_image;

/* --- Tracking and mapping -------------------------------------------------------------------- */

typedef struct oaslam_slam oaslam_slam;
typedef struct oaslam_map oaslam_map;
typedef struct oaslam_localizer oaslam_localizer;

/* Which settings a Slam begins with: SlamConfig::Live for an application with a camera,
 * SlamConfig::Offline for recordings. */
typedef enum { OASLAM_LIVE = 0, OASLAM_OFFLINE = 1 } oaslam_config;

/* oaslam::TrackingResult. oaslam_pose_in returns the pose. */
typedef struct {
  int32_t frame;
  double timestamp;
  oaslam_state state;
  oaslam_source source;
  uint32_t world; /* in which the pose is */
  int32_t is_uncertain;
  double confidence, seconds_without_map, depth;
  double focal_ratio;       /* of the image to the camera: 1 unless the lens was seen to change */
  double covariance[36];    /* rows of a 6x6 matrix: translation, rotation, in the camera's axes */
  int32_t matched, inliers; /* -1 where no landmarks were looked for */
  int32_t detections, objects;
  /* Other worlds in which the camera has a pose (oaslam::TrackingResult::elsewhere); of more than
   * eight, those that came last. */
  int32_t elsewhere_count;
  uint32_t elsewhere[8];
  struct {
    int32_t has_pose;
    oaslam_pose pose;
    oaslam_pose elsewhere[8];
  } reserved; /* read by oaslam_pose_in */
} oaslam_result;

/* The camera's pose in a world; returns 0, and writes nothing, where the camera has none there.
 * Content is drawn with the pose in the world that it was made in. */
OASLAM_API int32_t oaslam_pose_in(const oaslam_result* result, uint32_t world, oaslam_pose* pose);

/* How long the unit of a map is. */
typedef struct {
  double metres_per_unit;
  double relative_sigma;    /* standard deviation of metres_per_unit, divided by it */
  int32_t objects, classes; /* that agree with it */
} oaslam_scale_estimate;

/* `settings`: a configuration file that is read on top of `config`, or NULL. */
OASLAM_API oaslam_status oaslam_slam_create(oaslam_config config, const char* settings,
                                            const oaslam_camera* camera, oaslam_slam** slam);
OASLAM_API void oaslam_slam_destroy(oaslam_slam* slam);
OASLAM_API oaslam_status oaslam_slam_process(oaslam_slam* slam, const oaslam_image* image,
                                             oaslam_result* result);
/* Detections of an image that was processed with `detections_follow`; `frame` is that of its
 * result. `objects` becomes the number of mapped objects seen, -1 where the image is too old or had
 * no pose; it may be NULL. */
OASLAM_API oaslam_status oaslam_slam_add_detections(oaslam_slam* slam, int32_t frame,
                                                    const oaslam_detection* detections,
                                                    size_t count, int32_t* objects);
OASLAM_API oaslam_status oaslam_slam_finish(oaslam_slam* slam);
OASLAM_API oaslam_status oaslam_slam_reset(oaslam_slam* slam);
OASLAM_API oaslam_status oaslam_slam_set_mapping(oaslam_slam* slam, int32_t is_on);
OASLAM_API oaslam_status oaslam_slam_set_relocalization_mode(oaslam_slam* slam,
                                                             oaslam_relocalization_mode mode);
/* `near`: where the camera may be, world from camera, or NULL. */
OASLAM_API oaslam_status oaslam_slam_force_relocalization(oaslam_slam* slam,
                                                          const oaslam_pose* near);
/* A mask of grey bytes, in which 0 hides; NULL: Slam finds what moves with the camera from the
 * images. */
OASLAM_API oaslam_status oaslam_slam_set_mask(oaslam_slam* slam, const uint8_t* pixels,
                                              int32_t width, int32_t height, size_t bytes_per_row);
/* The pose of the IMU relative to the camera (Kalibr's T_cam_imu, metres); unless it is set, the
   IMU has the pose of the camera. */
OASLAM_API oaslam_status oaslam_slam_set_imu(oaslam_slam* slam, const oaslam_pose* cam_from_imu);
typedef enum {
  OASLAM_SENSOR_UNKNOWN = 0,
  OASLAM_SENSOR_CALIBRATED = 1,
  OASLAM_SENSOR_REFUSED = 2
} oaslam_sensor_state;
/* What the images have revealed about the IMU: oaslam::ImuCalibration. */
typedef struct {
  oaslam_sensor_state gyroscope, accelerometer;
  double gyroscope_bias[3], sigma_gyroscope_bias;       /* rad/s, to be subtracted, camera's axes */
  double offset_s, sigma_offset_s;                      /* of the clock, to be subtracted */
  double acceleration_bias[3], sigma_acceleration_bias; /* m/s^2, as that of the gyroscope */
  double sigma_metre; /* of the metre by the IMU, divided by it; 0: not known */
  char problem[256];  /* what is wrong with the IMU, cut to fit; empty: nothing */
} oaslam_imu_calibration;
/* That of a gyroscope alone, too, whose samples were given as `angular_velocity`. */
OASLAM_API oaslam_status oaslam_slam_imu(const oaslam_slam* slam, oaslam_imu_calibration* imu);
typedef struct {
  int32_t category_id;
  const char* name;
} oaslam_class_name;
OASLAM_API oaslam_status oaslam_slam_set_class_names(oaslam_slam* slam,
                                                     const oaslam_class_name* names, size_t count);
typedef struct {
  int32_t part, whole; /* categories */
} oaslam_class_part;
/* `movable`: the categories of things that move (oaslam::ClassRelations). */
OASLAM_API oaslam_status oaslam_slam_set_class_relations(oaslam_slam* slam,
                                                         const oaslam_class_part* parts,
                                                         size_t part_count, const int32_t* movable,
                                                         size_t movable_count);
OASLAM_API oaslam_status oaslam_slam_name_recording(oaslam_slam* slam, const char* name,
                                                    const char* images);
OASLAM_API oaslam_status oaslam_slam_set_metres_per_unit(oaslam_slam* slam, double metres);
/* Scales the map to metres by an estimate of oaslam_map_estimate_scale; the map keeps the
 * standard deviation of its unit. */
OASLAM_API oaslam_status oaslam_slam_set_scale(oaslam_slam* slam,
                                               const oaslam_scale_estimate* estimate);
OASLAM_API oaslam_status oaslam_slam_save(const oaslam_slam* slam, const char* path);
OASLAM_API oaslam_status oaslam_slam_load(oaslam_slam* slam, const char* path);
OASLAM_API oaslam_status oaslam_slam_load_map(oaslam_slam* slam, const oaslam_map* map);

typedef struct {
  double timestamp;
  oaslam_pose world_from_cam;
} oaslam_stamped_pose;
/* Writes the first `most` poses of the trajectory. `count` becomes the number written; where
 * `poses` is NULL, the number of all poses. The three functions after this one do the same. */
OASLAM_API oaslam_status oaslam_slam_trajectory(const oaslam_slam* slam, oaslam_stamped_pose* poses,
                                                size_t most, size_t* count);

/* oaslam::TrackedPoint. */
typedef struct {
  double pixel[2], sigma_px;
  int32_t has_landmark; /* else `landmark` and `position` are 0 */
  uint32_t landmark;
  double position[3];
} oaslam_tracked_point;
OASLAM_API oaslam_status oaslam_slam_tracked_points(const oaslam_slam* slam,
                                                    oaslam_tracked_point* points, size_t most,
                                                    size_t* count);

/* oaslam::FormerWorld: what was made in `world` is multiplied by `scale`. */
typedef struct {
  uint32_t world;
  double scale;
} oaslam_former_world;
OASLAM_API oaslam_status oaslam_slam_former_worlds(const oaslam_slam* slam,
                                                   oaslam_former_world* worlds, size_t most,
                                                   size_t* count);

/* oaslam::ObjectPresence. */
typedef struct {
  uint32_t object;
  int32_t category_id;
  int32_t expected, seen;
  int32_t is_missing;
} oaslam_object_presence;
OASLAM_API oaslam_status oaslam_slam_presence(const oaslam_slam* slam,
                                              oaslam_object_presence* objects, size_t most,
                                              size_t* count);

/* oaslam::ObjectEdit. NULL and 0 leave a thing as it is. */
typedef struct {
  const char* name; /* "": that of its class */
  int32_t is_same;  /* whether `same_as` is the same thing: its boxes go to this object */
  uint32_t same_as;
  int32_t remove;
} oaslam_object_edit;
OASLAM_API oaslam_status oaslam_slam_edit_object(oaslam_slam* slam, uint32_t object,
                                                 const oaslam_object_edit* edit);

/* --- Anchors --------------------------------------------------------------------------------- */

typedef struct {
  const char* name;    /* NULL: the name of the model with a number */
  const char* model;   /* only the application knows what it means */
  int32_t is_at_pixel; /* of the newest image; 0: by the ray */
  double pixel[2];
  /* A ray in the world; the content stands where the ray meets the map. */
  double origin[3], direction[3];
  int32_t is_on_object; /* on top of `object`; 0: on the plane of the landmarks around the ray */
  uint32_t object;
  double size;             /* map units; 0: one that suits the place */
  const oaslam_pose* pose; /* where it stands, instead of the ray; or NULL */
} oaslam_anchor_request;

/* NULL and 0 leave a thing as it is. */
typedef struct {
  const char* name;
  const char* model;
  double size;
  double turn_rad; /* about its y axis */
  const oaslam_pose* pose;
} oaslam_anchor_edit;

#define OASLAM_NAME_SIZE 65 /* bytes of the longest name of an anchor, with its end */

/* `name` becomes that of the new anchor; it may be NULL. OASLAM_REFUSED where there is no place. */
OASLAM_API oaslam_status oaslam_slam_place_anchor(oaslam_slam* slam,
                                                  const oaslam_anchor_request* request,
                                                  char name[OASLAM_NAME_SIZE]);
OASLAM_API oaslam_status oaslam_slam_edit_anchor(oaslam_slam* slam, const char* name,
                                                 const oaslam_anchor_edit* edit);
OASLAM_API oaslam_status oaslam_slam_remove_anchor(oaslam_slam* slam, const char* name);

/* --- What has happened ----------------------------------------------------------------------- */

/* The numbers of oaslam::SlamEventKind. */
typedef enum {
  OASLAM_STATE_CHANGED = 0,
  OASLAM_WORLD_CHANGED = 1,
  OASLAM_SUBMAP_BEGAN = 2,
  OASLAM_SUBMAP_JOINED = 3,
  OASLAM_LOOP_CLOSED = 4,
  OASLAM_MAP_IS_METRIC = 5,
  OASLAM_ANCHOR_PLACED = 6,
  OASLAM_ANCHOR_EDITED = 7,
  OASLAM_ANCHOR_MOVED = 8,
  OASLAM_ANCHOR_LOST = 9,
  OASLAM_ANCHOR_REMOVED = 10
} oaslam_event_kind;

#define OASLAM_NO_WORLD UINT32_MAX

/* oaslam::SlamEvent. */
typedef struct {
  uint64_t number;
  oaslam_event_kind kind;
  int32_t frame;
  double timestamp;              /* of that frame */
  oaslam_state state;            /* after it */
  uint32_t world;                /* after it */
  uint32_t submap;               /* of another submap, its world; OASLAM_NO_WORLD: none is named */
  char anchor[OASLAM_NAME_SIZE]; /* its name; empty for other events */
} oaslam_event;

/* Writes the first `most` events after the one with the number `after`; `count` becomes the number
 * written. The newest 1000 are kept: older ones have been dropped where the first number written is
 * more than `after` + 1. */
OASLAM_API oaslam_status oaslam_slam_events(const oaslam_slam* slam, uint64_t after,
                                            oaslam_event* events, size_t most, size_t* count);

/* --- What a ray meets ------------------------------------------------------------------------ */

typedef enum {
  OASLAM_HIT_OBJECT = 0,
  OASLAM_HIT_PLANE = 1,
  OASLAM_HIT_LANDMARK = 2
} oaslam_hit_kind;

/* oaslam::RayHit. */
typedef struct {
  oaslam_hit_kind kind;
  uint32_t id; /* of the object or the landmark; 0 for a plane */
  double distance, position[3], normal[3];
} oaslam_ray_hit;

/* Writes the nearest of the things that the ray of a pixel of the newest image meets, at most
 * `most`; `count` becomes the number written. None where that image has no pose. */
OASLAM_API oaslam_status oaslam_slam_cast(const oaslam_slam* slam, const double pixel[2],
                                          oaslam_ray_hit* hits, size_t most, size_t* count);
/* The same for a ray in the world of a map. */
OASLAM_API oaslam_status oaslam_map_cast(const oaslam_map* map, const double origin[3],
                                         const double direction[3], oaslam_ray_hit* hits,
                                         size_t most, size_t* count);

/* --- The map as data ------------------------------------------------------------------------- */

typedef struct {
  uint32_t id;
  int32_t category_id;
  const char* name;
  double center[3], half_axes[3];
  double rotation[4]; /* world from object; x, y, z, w */
  int32_t observations, has_moved;
} oaslam_object;
typedef struct {
  const char* name;
  const char* model;
  double size;
  oaslam_pose world_from_anchor; /* content: y up, front towards +z */
  int32_t is_on_object;
  uint32_t object;
} oaslam_anchor;
typedef struct {
  uint32_t id;
  double position[3];
  int32_t observations;
} oaslam_landmark;
typedef struct {
  uint32_t id;
  double timestamp;
  oaslam_pose world_from_cam;
} oaslam_keyframe;

/* The map as it is now; it does not change later. */
OASLAM_API oaslam_status oaslam_slam_map(const oaslam_slam* slam, oaslam_map** map);
/* Returns the map with all submaps, and with the trajectory so far. */
OASLAM_API oaslam_status oaslam_slam_whole_map(const oaslam_slam* slam, oaslam_map** map);
OASLAM_API oaslam_status oaslam_map_load(const char* path, oaslam_map** map);
OASLAM_API void oaslam_map_destroy(oaslam_map* map);
OASLAM_API oaslam_status oaslam_map_save(const oaslam_map* map, const char* path);
/* Returns the bytes of the file that oaslam_map_save writes. `bytes` live as long as the map. */
OASLAM_API oaslam_status oaslam_map_to_bytes(oaslam_map* map, const uint8_t** bytes, size_t* count);
OASLAM_API oaslam_status oaslam_map_from_bytes(const uint8_t* bytes, size_t count,
                                               oaslam_map** map);
/* The world of the map's coordinates. */
OASLAM_API uint32_t oaslam_map_world(const oaslam_map* map);
OASLAM_API int32_t oaslam_map_is_metric(const oaslam_map* map);
/* The relative standard deviation of the metre, where it follows from the usual sizes of
 * objects; else 0. */
OASLAM_API double oaslam_map_unit_sigma(const oaslam_map* map);
/* The length of the unit by the usual sizes of the objects (oaslam::ScaleEstimate). Returns
 * OASLAM_REFUSED where the estimate is not reliable. */
OASLAM_API oaslam_status oaslam_map_estimate_scale(const oaslam_map* map,
                                                   oaslam_scale_estimate* estimate);
/* `edited` becomes the map after a change to one of its objects; `map` stays. */
OASLAM_API oaslam_status oaslam_map_edit_object(const oaslam_map* map, uint32_t object,
                                                const oaslam_object_edit* edit,
                                                oaslam_map** edited);
/* Merges two maps that partly show the same place, in the frame of the first
 * (oaslam::MergeMaps). Returns OASLAM_REFUSED where the transformation between the maps is not
 * known. */
OASLAM_API oaslam_status oaslam_map_merge(const oaslam_map* first, const oaslam_map* second,
                                          oaslam_map** merged);
/* The numbers of oaslam::MapFormat. */
typedef enum {
  OASLAM_PLY = 0,
  OASLAM_GLTF = 1,
  OASLAM_TUM = 2,
  OASLAM_COLMAP = 3,
  OASLAM_NERFSTUDIO = 4,
  OASLAM_MCAP = 5
} oaslam_map_format;
OASLAM_API oaslam_status oaslam_map_export(const oaslam_map* map, oaslam_map_format format,
                                           const char* path);
/* The direction opposite to gravity; returns 0, and writes nothing, where it is not known. */
OASLAM_API int32_t oaslam_map_up(const oaslam_map* map, double up[3]);
/* All elements of a kind, in the order of their ids, names or times; `count` tells how many. Made
 * with the first call. NULL where there are none. */
OASLAM_API const oaslam_object* oaslam_map_objects(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_anchor* oaslam_map_anchors(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_landmark* oaslam_map_landmarks(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_keyframe* oaslam_map_keyframes(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_stamped_pose* oaslam_map_trajectory(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_class_name* oaslam_map_class_names(const oaslam_map* map, size_t* count);

/* --- Finding an image ------------------------------------------------------------------------ */

/* oaslam::RelocalizeOptions; NULL instead of it: the defaults. */
typedef struct {
  oaslam_relocalization_mode mode;
  const oaslam_pose* prior; /* where the camera may be, or NULL */
  /* Of the image; NULL: a Slam uses its own camera, a localizer estimates the camera. */
  const oaslam_camera* camera;
  int32_t unknown_camera; /* the camera is found with the pose */
  int32_t follow; /* the boxes belong to a video: earlier ones count, too; with a Slam only */
} oaslam_relocalize_options;

/* oaslam::RelocalizationResult. */
typedef struct {
  oaslam_evidence evidence;
  uint32_t world;
  oaslam_pose world_from_cam; /* where it was found */
  double confidence, sigma_position;
  int32_t inlier_points, matched_objects;
  int32_t has_camera; /* whether `camera` is set: the camera was unknown, and was found */
  oaslam_camera camera;
} oaslam_relocalization;

/* OASLAM_OK also where the image is not found: `evidence` tells this, and oaslam_error the
 * reason. */
OASLAM_API oaslam_status oaslam_slam_relocalize(oaslam_slam* slam, const oaslam_image* image,
                                                const oaslam_relocalize_options* options,
                                                oaslam_relocalization* found);
/* Makes a localizer in a map. The localizer keeps the map's content, so that the caller may
 * destroy the handle `map`. */
OASLAM_API oaslam_status oaslam_localizer_create(const oaslam_map* map,
                                                 oaslam_localizer** localizer);
OASLAM_API void oaslam_localizer_destroy(oaslam_localizer* localizer);
OASLAM_API oaslam_status oaslam_localizer_relocalize(const oaslam_localizer* localizer,
                                                     const oaslam_image* image,
                                                     const oaslam_relocalize_options* options,
                                                     oaslam_relocalization* found);

#ifdef __cplusplus
}
#endif

#endif /* OASLAM_OASLAM_C_H_ */
