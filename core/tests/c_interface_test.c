/* The interface for C: c_interface_test CAMERA FOLDER < FILM, whose images of 640x480 grey bytes
 * follow each other. Maps them, places an anchor, saves the map, loads it, finds an image, and calls
 * every other function once. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "oaslam/oaslam_c.h"

#define WIDTH 640
#define HEIGHT 480

#define CHECK(condition)                                                                          \
  do {                                                                                            \
    if (!(condition)) {                                                                           \
      fprintf(stderr, "line %d: %s; the last error: %s\n", __LINE__, #condition, oaslam_error()); \
      exit(1);                                                                                    \
    }                                                                                             \
  } while (0)

static uint8_t pixels[WIDTH * HEIGHT];
static uint16_t depth[WIDTH * HEIGHT / 16];

static oaslam_image image_at(double timestamp) {
  oaslam_image image;
  memset(&image, 0, sizeof image);
  image.pixels = pixels;
  image.width = WIDTH;
  image.height = HEIGHT;
  image.channels = 1;
  image.bytes_per_row = WIDTH;
  image.timestamp = timestamp;
  return image;
}

static void check_cameras(const oaslam_camera* camera) {
  const double pixel[2] = {100, 80}, behind[3] = {0, 0, -1};
  double ray[3], again[2];
  int32_t is_there = 0;
  CHECK(oaslam_camera_lift(camera, pixel, ray, &is_there) == OASLAM_OK && is_there);
  CHECK(ray[2] == 1);
  CHECK(oaslam_camera_project(camera, ray, again, &is_there) == OASLAM_OK && is_there);
  CHECK(fabs(again[0] - pixel[0]) < 1e-6 && fabs(again[1] - pixel[1]) < 1e-6);
  CHECK(oaslam_camera_project(camera, behind, again, &is_there) == OASLAM_OK && !is_there);
}

/* A pose in another world is found by that world's number. */
static void check_worlds(oaslam_result result) {
  oaslam_pose pose;
  memset(&pose, 0, sizeof pose);
  CHECK(result.elsewhere_count == 0 && !oaslam_pose_in(&result, result.world + 1, &pose));
  result.elsewhere_count = 2;
  result.elsewhere[0] = result.world + 2;
  result.elsewhere[1] = result.world + 1;
  result.reserved.elsewhere[1].translation[0] = 3;
  CHECK(oaslam_pose_in(&result, result.world + 1, &pose) && pose.translation[0] == 3);
  CHECK(!oaslam_pose_in(&result, result.world + 3, &pose));
}

static void check_errors(const oaslam_camera* camera) {
  oaslam_camera none;
  oaslam_slam* slam = NULL;
  oaslam_map* map = NULL;
  oaslam_result result;
  oaslam_image image = image_at(0);
  size_t count = 1;
  oaslam_scale_estimate scale = {0, 0, 0, 0};
  memset(&none, 0, sizeof none);
  CHECK(oaslam_camera_load("nowhere.yaml", WIDTH, HEIGHT, &none) == OASLAM_INPUT_ERROR);
  CHECK(strstr(oaslam_error(), "nowhere.yaml"));
  CHECK(oaslam_slam_create(OASLAM_LIVE, NULL, &none, &slam) == OASLAM_INPUT_ERROR && !slam);
  CHECK(strstr(oaslam_error(), "image width"));
  CHECK(oaslam_slam_create(OASLAM_LIVE, NULL, NULL, &slam) == OASLAM_INPUT_ERROR);
  CHECK(strstr(oaslam_error(), "NULL"));
  CHECK(oaslam_map_load("nowhere.map", &map) == OASLAM_INPUT_ERROR && !map);
  CHECK(oaslam_slam_process(NULL, &image, &result) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_map_objects(NULL, &count) == NULL && count == 0);
  oaslam_slam_destroy(NULL);
  oaslam_map_destroy(NULL);
  oaslam_localizer_destroy(NULL);

  CHECK(oaslam_slam_create(OASLAM_OFFLINE, NULL, camera, &slam) == OASLAM_OK);
  image.channels = 2;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  CHECK(strstr(oaslam_error(), "channels: 2"));
  image.channels = 1;
  image.bytes_per_row = 5;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  image = image_at(NAN);
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  CHECK(strstr(oaslam_error(), "time stamp"));
  image = image_at(0);
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_OK);
  CHECK(result.frame == 0 && oaslam_pose_in(&result, result.world + 1, NULL) == 0);
  check_worlds(result);
  CHECK(oaslam_slam_set_metres_per_unit(slam, 2) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_set_scale(slam, NULL) == OASLAM_INPUT_ERROR);
  scale.metres_per_unit = 2;
  CHECK(oaslam_slam_set_scale(slam, &scale) == OASLAM_INPUT_ERROR);
  CHECK(strstr(oaslam_error(), "by 0 objects"));
  CHECK(oaslam_slam_remove_anchor(slam, "none") == OASLAM_REFUSED);
  CHECK(strstr(oaslam_error(), "no anchor"));
  oaslam_slam_destroy(slam);
}

static void through_bytes(const char* path) {
  oaslam_map *map = NULL, *again = NULL;
  const uint8_t *bytes = NULL, *same = NULL;
  size_t count = 0, same_count = 0;
  CHECK(oaslam_map_load(path, &map) == OASLAM_OK);
  CHECK(oaslam_map_to_bytes(map, &bytes, &count) == OASLAM_OK && count > 1000);
  CHECK(oaslam_map_from_bytes(bytes, count, &again) == OASLAM_OK);
  CHECK(oaslam_map_to_bytes(again, &same, &same_count) == OASLAM_OK);
  CHECK(same_count == count && memcmp(bytes, same, count) == 0);
  oaslam_map_destroy(again);
  CHECK(oaslam_map_from_bytes(bytes, 100, &again) == OASLAM_INPUT_ERROR);
  CHECK(strncmp(oaslam_error(), "map: ", 5) == 0);
  oaslam_map_destroy(map);
}

static void cast_rays(const oaslam_slam* slam, const oaslam_camera* camera) {
  oaslam_ray_hit hits[8];
  oaslam_map* map = NULL;
  const double outside[2] = {-1, 0}, nowhere[3] = {0, 0, 0};
  double pixel[2];
  size_t count = 0;
  CHECK(oaslam_slam_cast(slam, outside, hits, 8, &count) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_map(slam, &map) == OASLAM_OK);
  CHECK(oaslam_map_cast(map, nowhere, nowhere, hits, 8, &count) == OASLAM_INPUT_ERROR);
  oaslam_map_destroy(map);
  pixel[0] = camera->width / 2.0;
  pixel[1] = camera->height / 2.0;
  CHECK(oaslam_slam_cast(slam, pixel, hits, 8, &count) == OASLAM_OK);
  CHECK(count > 0 && hits[0].distance > 0);
  CHECK(oaslam_slam_cast(slam, pixel, hits, 1, &count) == OASLAM_OK && count == 1);
  CHECK(oaslam_slam_cast(slam, pixel, NULL, 0, &count) == OASLAM_OK && count == 0);
}

static void place_anchor(oaslam_slam* slam, const oaslam_pose* pose) {
  oaslam_anchor_request request;
  oaslam_anchor_edit edit;
  char name[OASLAM_NAME_SIZE] = "";
  oaslam_pose no_pose;
  memset(&no_pose, 0, sizeof no_pose);
  memset(&request, 0, sizeof request);
  memset(&edit, 0, sizeof edit);
  request.model = "flag";
  CHECK(oaslam_slam_place_anchor(slam, &request, name) == OASLAM_REFUSED); /* no direction */
  request.pose = &no_pose;
  CHECK(oaslam_slam_place_anchor(slam, &request, name) == OASLAM_REFUSED);
  CHECK(strstr(oaslam_error(), "quaternion"));
  request.pose = pose;
  CHECK(oaslam_slam_place_anchor(slam, &request, name) == OASLAM_OK);
  CHECK(strcmp(name, "flag 1") == 0);
  edit.name = "here";
  CHECK(oaslam_slam_edit_anchor(slam, name, &edit) == OASLAM_OK);
  CHECK(oaslam_slam_edit_anchor(slam, name, &edit) == OASLAM_REFUSED);
}

static void count_message(void* context, oaslam_log_level level, const char* message) {
  if (level <= OASLAM_LOG_WARNING && strlen(message) > 0) ++*(int*)context;
}

/* What a Slam tells of its points, objects and worlds, and what it is told of its classes. */
static void ask_more(oaslam_slam* slam, const oaslam_result* result) {
  const oaslam_class_part part = {66, 60}, itself = {66, 66};
  const int32_t person = 0;
  oaslam_tracked_point points[3];
  oaslam_object_presence presence[1];
  oaslam_former_world former[1];
  size_t count = 0, all = 0;
  int messages = 0;
  CHECK(oaslam_slam_tracked_points(slam, NULL, 0, &all) == OASLAM_OK);
  CHECK(all > 3 && (result->inliers < 0 || all > (size_t)result->inliers));
  CHECK(oaslam_slam_tracked_points(slam, points, 3, &count) == OASLAM_OK && count == 3);
  CHECK(points[2].sigma_px > 0 && points[2].pixel[0] < WIDTH);
  CHECK(oaslam_slam_presence(slam, presence, 1, &count) == OASLAM_OK && count == 0);
  CHECK(oaslam_slam_former_worlds(slam, former, 1, &count) == OASLAM_OK && count == 0);
  CHECK(oaslam_slam_set_class_relations(slam, &part, 1, &person, 1) == OASLAM_OK);
  CHECK(oaslam_slam_set_class_relations(slam, &itself, 1, NULL, 0) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_set_class_relations(slam, NULL, 1, NULL, 0) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_name_recording(slam, "a walk", NULL) == OASLAM_OK);
  CHECK(oaslam_slam_name_recording(slam, NULL, NULL) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_set_log_sink(count_message, &messages) == OASLAM_OK);
  CHECK(oaslam_slam_reset(slam) == OASLAM_OK);
  CHECK(oaslam_slam_save(slam, "/nowhere/c.map") == OASLAM_INPUT_ERROR && messages == 1);
  CHECK(oaslam_set_log_sink(NULL, NULL) == OASLAM_OK);
  CHECK(oaslam_slam_save(slam, "/nowhere/c.map") == OASLAM_INPUT_ERROR && messages == 1);
}

/* What a Slam tells besides poses, and what it is told besides images. */
static void ask_and_tell(oaslam_slam* slam, const oaslam_result* result) {
  static uint8_t mask[WIDTH * HEIGHT];
  const oaslam_class_name names[] = {{41, "my mug"}};
  oaslam_stamped_pose poses[4];
  oaslam_event events[64];
  oaslam_object_edit edit;
  oaslam_detection box = {41, 0.9, 10, 10, 50, 60};
  int32_t objects = 7;
  size_t count = 0, all = 0;
  memset(&edit, 0, sizeof edit);
  memset(mask, 255, sizeof mask);
  CHECK(oaslam_slam_trajectory(slam, NULL, 0, &all) == OASLAM_OK && all > 50);
  CHECK(oaslam_slam_trajectory(slam, poses, 4, &count) == OASLAM_OK && count == 4);
  CHECK(poses[0].timestamp < poses[3].timestamp);
  CHECK(oaslam_slam_events(slam, 0, events, 64, &count) == OASLAM_OK && count > 0);
  CHECK(events[0].number == 1 && events[0].kind == OASLAM_STATE_CHANGED);
  CHECK(events[0].submap == OASLAM_NO_WORLD && events[count - 1].timestamp > 0);
  CHECK(events[count - 1].state == OASLAM_TRACKING && events[count - 1].world == result->world);
  CHECK(oaslam_slam_events(slam, events[count - 1].number, events, 64, &count) == OASLAM_OK);
  CHECK(count == 0);
  CHECK(oaslam_slam_edit_object(slam, 5, &edit) == OASLAM_INPUT_ERROR);
  CHECK(strstr(oaslam_error(), "no object 5"));
  CHECK(oaslam_slam_add_detections(slam, result->frame, &box, 1, &objects) == OASLAM_OK);
  CHECK(objects < 1);
  CHECK(oaslam_slam_add_detections(slam, result->frame, NULL, 1, NULL) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_set_class_names(slam, names, 1) == OASLAM_OK);
  CHECK(oaslam_slam_set_relocalization_mode(slam, OASLAM_USE_POINTS) == OASLAM_OK);
  CHECK(oaslam_slam_set_mask(slam, mask, WIDTH, HEIGHT, WIDTH) == OASLAM_OK);
  CHECK(oaslam_slam_set_mask(slam, mask, WIDTH, HEIGHT / 2, WIDTH) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_set_mask(slam, NULL, 0, 0, 0) == OASLAM_OK);
}

/* An image whose motion, gyroscope and key points another program has found. */
static void give_measurements(const oaslam_camera* camera) {
  const oaslam_angular_velocity turn[2] = {{0.01, {0, 0.1, 0}}, {0.02, {0, 0.1, 0}}};
  const oaslam_point_depth depths[1] = {{{100, 80}, 0.5}};
  oaslam_feature features[2];
  oaslam_features found;
  oaslam_motion motion;
  oaslam_slam* slam = NULL;
  oaslam_result result;
  oaslam_image image = image_at(0.02);
  memset(&motion, 0, sizeof motion);
  memset(features, 0, sizeof features);
  memset(&found, 0, sizeof found);
  features[0].pixel[0] = features[1].pixel[1] = 30;
  found.features = features;
  found.count = 2;
  motion.is_known = 1;
  motion.image = 1;
  motion.odom_from_cam.rotation[3] = 1;
  motion.depths = depths;
  motion.depth_count = 1;
  image.pixels = NULL;
  image.motion = &motion;
  image.features = &found;
  image.angular_velocity = turn;
  image.angular_velocity_count = 2;
  CHECK(oaslam_slam_create(OASLAM_LIVE, NULL, camera, &slam) == OASLAM_OK);
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_OK);
  CHECK(result.frame == 0 && result.state != OASLAM_TRACKING);
  image.timestamp = 0.04;
  motion.odom_from_cam.rotation[3] = 0;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  motion.odom_from_cam.rotation[3] = 1;
  motion.image = 2;
  found.levels = 99;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  found.levels = 0;
  image.depth = depth;
  image.depth_width = WIDTH / 4;
  image.depth_height = HEIGHT / 4;
  image.depth_bytes_per_row = 0;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  image.depth_bytes_per_row = WIDTH / 4 * sizeof depth[0];
  image.depth_unit = 5;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  image.depth_unit = 0;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_OK);
  oaslam_slam_destroy(slam);
}

/* An IMU gives the odometry what it measures along its own axes. */
static void give_imu(const oaslam_camera* camera) {
  const oaslam_imu_sample samples[2] = {{0.01, {0, 0.1, 0}, {0, -9.8, 0}},
                                        {0.02, {0, 0.1, 0}, {0, -9.8, 0}}};
  oaslam_pose cam_from_imu;
  oaslam_imu_calibration imu;
  oaslam_slam* slam = NULL;
  oaslam_result result;
  oaslam_image image = image_at(0.02);
  memset(&cam_from_imu, 0, sizeof cam_from_imu);
  cam_from_imu.rotation[3] = 1;
  image.imu = samples;
  image.imu_count = 2;
  CHECK(oaslam_slam_create(OASLAM_LIVE, NULL, camera, &slam) == OASLAM_OK);
  CHECK(oaslam_slam_set_imu(slam, &cam_from_imu) == OASLAM_OK);
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_OK);
  memset(&imu, 0xff, sizeof imu);
  CHECK(oaslam_slam_imu(slam, &imu) == OASLAM_OK);
  CHECK(imu.gyroscope == OASLAM_SENSOR_UNKNOWN && imu.accelerometer == OASLAM_SENSOR_UNKNOWN);
  CHECK(imu.sigma_gyroscope_bias > 0 && imu.sigma_metre == 0 && imu.problem[0] == 0);
  image.timestamp = 0.04;
  image.imu_count = 0;
  image.angular_velocity_count = 1;
  CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_INPUT_ERROR);
  cam_from_imu.translation[0] = 64; /* millimetres */
  CHECK(oaslam_slam_set_imu(slam, &cam_from_imu) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_set_imu(slam, NULL) == OASLAM_INPUT_ERROR);
  oaslam_slam_destroy(slam);
}

/* A map as data goes to a file of another tool, into another map, and into a Slam. */
static void use_map(const char* path, const char* folder, const oaslam_camera* camera) {
  oaslam_map *map = NULL, *both = NULL;
  oaslam_slam* slam = NULL;
  oaslam_object_edit edit;
  char file[4096];
  size_t keyframes = 0, of_both = 0;
  memset(&edit, 0, sizeof edit);
  CHECK(oaslam_map_load(path, &map) == OASLAM_OK);
  CHECK(oaslam_map_merge(map, map, &both) == OASLAM_OK);
  CHECK(oaslam_map_keyframes(map, &keyframes) && oaslam_map_keyframes(both, &of_both));
  CHECK(of_both > keyframes);
  CHECK(oaslam_map_edit_object(map, 3, &edit, &both) == OASLAM_INPUT_ERROR);
  oaslam_map_destroy(both);
  snprintf(file, sizeof file, "%s/c.ply", folder);
  CHECK(oaslam_map_export(map, OASLAM_PLY, file) == OASLAM_OK);
  CHECK(remove(file) == 0);
  CHECK(oaslam_map_export(map, OASLAM_GLTF, file) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_create((oaslam_config)7, NULL, camera, &slam) == OASLAM_INPUT_ERROR);
  CHECK(oaslam_slam_create(OASLAM_LIVE, NULL, camera, &slam) == OASLAM_OK);
  CHECK(oaslam_slam_load_map(slam, map) == OASLAM_OK);
  CHECK(oaslam_slam_force_relocalization(slam, NULL) == OASLAM_OK);
  CHECK(oaslam_slam_whole_map(slam, &both) == OASLAM_OK);
  CHECK(oaslam_map_keyframes(both, &of_both) && of_both == keyframes);
  oaslam_map_destroy(both);
  oaslam_slam_destroy(slam);
  oaslam_map_destroy(map);
}

static void check_map(const oaslam_map* map, const oaslam_pose* pose) {
  oaslam_scale_estimate scale;
  size_t anchors = 0, landmarks = 0, keyframes = 0, poses = 0, names = 0;
  double up[3] = {0, 0, 0};
  const oaslam_class_name* name = oaslam_map_class_names(map, &names);
  const oaslam_anchor* anchor = oaslam_map_anchors(map, &anchors);
  const oaslam_landmark* landmark = oaslam_map_landmarks(map, &landmarks);
  CHECK(anchors == 1 && strcmp(anchor->name, "here") == 0 && strcmp(anchor->model, "flag") == 0);
  CHECK(fabs(anchor->world_from_anchor.translation[0] - pose->translation[0]) < 1e-9);
  CHECK(landmarks > 200 && landmark[0].id < landmark[1].id && landmark->observations > 1);
  CHECK(oaslam_map_keyframes(map, &keyframes) && keyframes > 3);
  CHECK(oaslam_map_landmarks(map, NULL) == landmark);
  CHECK(names == 1 && name->category_id == 41 && strcmp(name->name, "my mug") == 0);
  CHECK(oaslam_map_trajectory(map, &poses) && poses >= keyframes);
  CHECK(!oaslam_map_up(map, up) || fabs(up[0] * up[0] + up[1] * up[1] + up[2] * up[2] - 1) < 1e-6);
  CHECK(!oaslam_map_is_metric(map) && oaslam_map_unit_sigma(map) == 0);
  /* Without boxes there are no objects. */
  CHECK(oaslam_map_estimate_scale(map, &scale) == OASLAM_REFUSED);
  CHECK(strlen(oaslam_error()) > 0);
}

static void find_image(const char* path, const oaslam_camera* camera, const oaslam_pose* expected) {
  oaslam_map* map = NULL;
  oaslam_localizer* localizer = NULL;
  oaslam_slam* slam = NULL;
  oaslam_relocalize_options options;
  oaslam_relocalization found;
  oaslam_image image = image_at(0);
  const oaslam_image nothing = {0};
  memset(&options, 0, sizeof options);
  options.mode = OASLAM_USE_POINTS;
  options.camera = camera;
  CHECK(oaslam_map_load(path, &map) == OASLAM_OK);
  check_map(map, expected);
  CHECK(oaslam_localizer_create(map, &localizer) == OASLAM_OK);
  oaslam_map_destroy(map);
  CHECK(oaslam_localizer_relocalize(localizer, &image, &options, &found) == OASLAM_OK);
  CHECK(found.evidence == OASLAM_FOUND_BY_POINTS && found.inlier_points > 30);
  CHECK(fabs(found.world_from_cam.translation[0] - expected->translation[0]) < 0.1);
  CHECK(oaslam_localizer_relocalize(localizer, &image, NULL, &found) == OASLAM_OK);
  CHECK(found.evidence != OASLAM_NOT_FOUND && found.has_camera);
  CHECK(oaslam_localizer_relocalize(localizer, &nothing, &options, &found) == OASLAM_OK);
  CHECK(found.evidence == OASLAM_NOT_FOUND && strlen(oaslam_error()) > 0);
  oaslam_localizer_destroy(localizer);
  CHECK(oaslam_slam_create(OASLAM_LIVE, NULL, camera, &slam) == OASLAM_OK);
  CHECK(oaslam_slam_load(slam, path) == OASLAM_OK);
  CHECK(oaslam_slam_relocalize(slam, &image, NULL, &found) == OASLAM_OK);
  CHECK(found.evidence == OASLAM_FOUND_BY_POINTS);
  oaslam_slam_destroy(slam);
}

/* A forked child cannot use the handle, and may free it. */
static void fork_child(oaslam_slam* slam) {
  int status = 0;
  const pid_t child = fork();
  if (child == 0) {
    alarm(30);
    CHECK(oaslam_slam_finish(slam) == OASLAM_FORK_ERROR && strstr(oaslam_error(), "forked"));
    oaslam_slam_destroy(slam);
    exit(0);
  }
  CHECK(waitpid(child, &status, 0) == child && status == 0);
}

int main(int argc, char** argv) {
  oaslam_camera camera;
  oaslam_slam* slam = NULL;
  oaslam_map* map = NULL;
  oaslam_result result;
  oaslam_pose pose, last;
  char path[4096];
  int frames = 0, has_pose = 0;
  if (argc != 3) return 2;
  CHECK(oaslam_camera_load(argv[1], WIDTH, HEIGHT, &camera) == OASLAM_OK);
  check_cameras(&camera);
  check_errors(&camera);
  CHECK(oaslam_slam_create(OASLAM_OFFLINE, NULL, &camera, &slam) == OASLAM_OK);
  while (fread(pixels, sizeof pixels, 1, stdin) == 1) {
    const oaslam_image image = image_at(frames++ / 30.0);
    CHECK(oaslam_slam_process(slam, &image, &result) == OASLAM_OK);
    if (oaslam_pose_in(&result, result.world, &pose)) {
      has_pose = 1;
      last = pose;
    }
  }
  CHECK(frames > 50 && has_pose && result.state == OASLAM_TRACKING);
  CHECK((result.source == OASLAM_FROM_MAP) == (result.inliers > 0));
  CHECK(result.covariance[0] > 0 && !oaslam_pose_in(&result, result.world + 1, &pose));
  fork_child(slam);
  CHECK(oaslam_slam_finish(slam) == OASLAM_OK);
  ask_and_tell(slam, &result);
  cast_rays(slam, &camera);
  place_anchor(slam, &last);
  CHECK(oaslam_slam_map(slam, &map) == OASLAM_OK && oaslam_map_world(map) == result.world);
  check_map(map, &last);
  oaslam_map_destroy(map);
  snprintf(path, sizeof path, "%s/c.map", argv[2]);
  CHECK(oaslam_slam_save(slam, path) == OASLAM_OK);
  CHECK(oaslam_slam_save(slam, "/nowhere/c.map") == OASLAM_INPUT_ERROR);
  ask_more(slam, &result);
  oaslam_slam_destroy(slam);
  find_image(path, &camera, &last);
  through_bytes(path);
  use_map(path, argv[2], &camera);
  give_measurements(&camera);
  give_imu(&camera);
  remove(path);
  printf("%d images\n", frames);
  return 0;
}
