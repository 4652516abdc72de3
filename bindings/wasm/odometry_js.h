#pragma once

#include <cstdint>

// The odometry for callers in other languages, without exceptions: what
// web/src/odometry/oaslam_odometry.js calls. Lengths are in the odometry's unit, angles in rad,
// times in seconds, pixels as in oaslam/camera.h.
extern "C" {

struct OaslamOdometry;

// Of one image. Layout and order are known to oaslam_odometry.js.
struct OaslamEstimate {
  double rotation[4];  // of cam_from_odom: x y z w
  double translation[3];
  double covariance[36];  // of PoseCovariance, symmetric
  // Of the unit, by an accelerometer; the sigma is divided by it. Zeros while it is not known.
  double metres_per_unit, metre_sigma;
  double gravity[3];  // m/s^2, along the camera's axes; zeros while it is not known
  int32_t state;      // OdometryState
  int32_t run, image;
  int32_t is_keyframe;
  int32_t tracked, inliers;
  int32_t points;     // how many oaslam_odometry_points has
  int32_t keyframes;  // how many oaslam_odometry_keyframes has
};

// Never null: where the camera is refused, oaslam_odometry_problem says why, and nothing else may
// be called but delete. `seed`: a whole number below 2^53.
OaslamOdometry* oaslam_odometry_new(int is_fisheye, int width, int height, double fx, double fy,
                                    double cx, double cy, double k1, double k2, double k3,
                                    double k4, double k5, double seed);
// What was wrong with the last call; an empty text where nothing was.
const char* oaslam_odometry_problem(const OaslamOdometry* odometry);
// Where the caller writes the next image: width * height grey bytes.
uint8_t* oaslam_odometry_image(OaslamOdometry* odometry);
// Where the caller may write it instead, in rows of red, green, blue and alpha.
uint8_t* oaslam_odometry_rgba(OaslamOdometry* odometry);
// Where the caller writes `count` samples. Of 4 `columns`: time and the angular velocity of a
// gyroscope; of 7: with the acceleration of an IMU. About and along the camera's axes.
double* oaslam_odometry_samples(OaslamOdometry* odometry, int count, int columns);
// Null where the time or a sample is refused; then nothing has changed. `is_rgba`: the image is
// where oaslam_odometry_rgba says. The estimate is valid until the next call.
const OaslamEstimate* oaslam_odometry_process(OaslamOdometry* odometry, double time_s, int is_rgba,
                                              int samples);
// Of the last image, x, y and inverse depth each, those whose depth is known to a third.
const float* oaslam_odometry_points(const OaslamOdometry* odometry);
// The window's keyframes as they are known with the last image, by image, ascending: each its
// image, the camera's position in the odometry's frame (x, y, z) and its rotation from the camera's
// axes to those of the frame (x, y, z, w).
const double* oaslam_odometry_keyframes(const OaslamOdometry* odometry);
// Extracts about `count` ORB key points of the last image, and returns how many there are.
int oaslam_odometry_features(OaslamOdometry* odometry, int count);
// Of these: of all x and y in the ideal image and the angle in rad (float), then of all the octave
// (a byte), then of all the descriptors (32 bytes). Little-endian; valid until the next image.
const uint8_t* oaslam_odometry_feature_bytes(const OaslamOdometry* odometry);
// The size of a pixel of the lowest level of their pyramid, in pixels of the image.
double oaslam_odometry_lowest_scale(const OaslamOdometry* odometry);
void oaslam_odometry_delete(OaslamOdometry* odometry);

}  // extern "C"
