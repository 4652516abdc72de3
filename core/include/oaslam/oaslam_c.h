#ifndef OASLAM_OASLAM_C_H_
#define OASLAM_OASLAM_C_H_

/* The library for C and all that can call C (Swift, C#, Rust, Unity). What a function means, its
 * frames and units are those of the C++ function that it is named after: oaslam_slam_process is
 * oaslam::Slam::Process. docs/c.md has an example.
 *
 * Handles. *_create, *_load and oaslam_slam_map make one, *_destroy frees it and takes NULL. A
 * handle of a Slam is for one thread at a time; those of maps and localizers are for any number.
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
  OASLAM_REFUSED = 3,       /* an anchor cannot be placed or changed so, or a scale is not known */
  OASLAM_OTHER_ERROR = 4    /* e.g. memory ran out */
} oaslam_status;

/* What the last call in this thread that did not return OASLAM_OK had to say. Lives until the
 * thread's next such call. */
OASLAM_API const char* oaslam_error(void);

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
/* The same for a pixel that the lens model does not know; the ray has z = 1. */
OASLAM_API oaslam_status oaslam_camera_lift(const oaslam_camera* camera, const double pixel[2],
                                            double ray[3], int32_t* is_known);

/* --- Images ---------------------------------------------------------------------------------- */

typedef struct {
  int32_t category_id;
  double score;
  double x1, y1, x2, y2; /* edges, pixels of the image as it is given */
} oaslam_detection;

/* oaslam::ImageInput. All of it may be zero but what is known. */
typedef struct {
  const uint8_t* pixels; /* NULL: boxes alone (relocalize only) */
  int32_t width, height;
  int32_t channels; /* 1 grey, 3 BGR, 4 BGRA */
  size_t bytes_per_row;
  double timestamp; /* seconds, ascending */
  const oaslam_detection* detections;
  size_t detection_count;
  const double* gravity_in_cam; /* three numbers; NULL: not measured */
} oaslam_image;

/* --- Tracking and mapping -------------------------------------------------------------------- */

typedef struct oaslam_slam oaslam_slam;
typedef struct oaslam_map oaslam_map;
typedef struct oaslam_localizer oaslam_localizer;

/* Which settings a Slam begins with: SlamConfig::Live for an application with a camera,
 * SlamConfig::Offline for recordings. */
typedef enum { OASLAM_LIVE = 0, OASLAM_OFFLINE = 1 } oaslam_config;

/* oaslam::TrackingResult. The pose is had by oaslam_pose_in. */
typedef struct {
  int32_t frame;
  double timestamp;
  oaslam_state state;
  oaslam_source source;
  uint32_t world; /* in which the pose is */
  int32_t is_uncertain;
  double confidence, seconds_without_map, depth;
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
OASLAM_API oaslam_status oaslam_slam_finish(oaslam_slam* slam);
OASLAM_API oaslam_status oaslam_slam_reset(oaslam_slam* slam);
OASLAM_API oaslam_status oaslam_slam_set_mapping(oaslam_slam* slam, int32_t is_on);
OASLAM_API oaslam_status oaslam_slam_set_metres_per_unit(oaslam_slam* slam, double metres);
/* The same by what oaslam_map_estimate_scale told; the map keeps how sure its unit is. */
OASLAM_API oaslam_status oaslam_slam_set_scale(oaslam_slam* slam,
                                               const oaslam_scale_estimate* estimate);
OASLAM_API oaslam_status oaslam_slam_save(const oaslam_slam* slam, const char* path);
OASLAM_API oaslam_status oaslam_slam_load(oaslam_slam* slam, const char* path);

/* --- Anchors --------------------------------------------------------------------------------- */

typedef struct {
  const char* name;    /* NULL: the name of the model with a number */
  const char* model;   /* only the application knows what it means */
  int32_t is_at_pixel; /* of the newest image; 0: by the ray */
  double pixel[2];
  double origin[3], direction[3]; /* a ray in the world, that meets the map where it stands */
  int32_t is_on_object;           /* on top of this object; 0: on the landmarks about the ray */
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
OASLAM_API oaslam_status oaslam_map_load(const char* path, oaslam_map** map);
OASLAM_API void oaslam_map_destroy(oaslam_map* map);
OASLAM_API oaslam_status oaslam_map_save(const oaslam_map* map, const char* path);
/* The same as bytes, to be sent or kept elsewhere. `bytes` belong to the map, until it is destroyed
 * or asked again. */
OASLAM_API oaslam_status oaslam_map_to_bytes(oaslam_map* map, const uint8_t** bytes, size_t* count);
OASLAM_API oaslam_status oaslam_map_from_bytes(const uint8_t* bytes, size_t count,
                                               oaslam_map** map);
/* The world of its coordinates. */
OASLAM_API uint32_t oaslam_map_world(const oaslam_map* map);
OASLAM_API int32_t oaslam_map_is_metric(const oaslam_map* map);
/* Where the metre follows from the usual sizes of objects: its standard deviation, divided by it;
 * else 0. */
OASLAM_API double oaslam_map_unit_sigma(const oaslam_map* map);
/* The length of the unit by the usual sizes of the objects (oaslam::ScaleEstimate). OASLAM_REFUSED
 * where it is not to be believed. */
OASLAM_API oaslam_status oaslam_map_estimate_scale(const oaslam_map* map,
                                                   oaslam_scale_estimate* estimate);
/* All elements of a kind, in the order of their ids or names; `count` tells how many. Made with the
 * first call. NULL where there are none. */
OASLAM_API const oaslam_object* oaslam_map_objects(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_anchor* oaslam_map_anchors(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_landmark* oaslam_map_landmarks(const oaslam_map* map, size_t* count);
OASLAM_API const oaslam_keyframe* oaslam_map_keyframes(const oaslam_map* map, size_t* count);

/* --- Finding an image ------------------------------------------------------------------------ */

/* oaslam::RelocalizeOptions; NULL instead of it: the defaults. */
typedef struct {
  oaslam_relocalization_mode mode;
  const oaslam_pose* prior;    /* where the camera may be, or NULL */
  const oaslam_camera* camera; /* of the image, or NULL: the Slam's; a localizer finds it */
  int32_t unknown_camera;      /* the camera is found with the pose */
  int32_t follow;              /* boxes of a film, by a Slam */
} oaslam_relocalize_options;

/* oaslam::RelocalizationResult. */
typedef struct {
  oaslam_evidence evidence;
  uint32_t world;
  oaslam_pose world_from_cam; /* where it was found */
  double confidence, sigma_position;
  int32_t inlier_points, matched_objects;
  int32_t has_camera; /* that was unknown, and found */
  oaslam_camera camera;
} oaslam_relocalization;

/* OASLAM_OK also where the image is not found: `evidence` tells, and oaslam_error why not. */
OASLAM_API oaslam_status oaslam_slam_relocalize(oaslam_slam* slam, const oaslam_image* image,
                                                const oaslam_relocalize_options* options,
                                                oaslam_relocalization* found);
/* Of a map that the localizer keeps, which may be destroyed. */
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
