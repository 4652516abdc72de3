#pragma once

#include <array>
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "oaslam/error.h"
#include "oaslam/oaslam_c.h"
#include "oaslam/slam.h"

// Conversions between the values of the C and the C++ interface, and of exceptions to status codes.
namespace oaslam::c {

// What oaslam_error tells in this thread.
const std::string& ErrorOfThread() noexcept;
// Sets the text that oaslam_error returns, if there is memory for it, and returns `status`.
oaslam_status Failed(oaslam_status status, const char* what) noexcept;

// Calls a function that returns nothing or a status. No exception leaves it. `needed`: arguments
// that must not be NULL.
template <typename Function, typename... Needed>
oaslam_status Call(Function&& function, const Needed*... needed) noexcept {
  if (((needed == nullptr) || ...))
    return Failed(OASLAM_INPUT_ERROR, "an argument that is needed is NULL");
  try {
    if constexpr (std::is_void_v<decltype(function())>) {
      function();
      return OASLAM_OK;
    } else {
      return function();
    }
  } catch (const InputError& error) {
    return Failed(OASLAM_INPUT_ERROR, error.what());
  } catch (const MappingError& error) {
    return Failed(OASLAM_MAPPING_ERROR, error.what());
  } catch (const ForkError& error) {
    return Failed(OASLAM_FORK_ERROR, error.what());
  } catch (const std::exception& error) {
    return Failed(OASLAM_OTHER_ERROR, error.what());
  } catch (...) {
    return Failed(OASLAM_OTHER_ERROR, "unknown error");
  }
}

template <typename Vector, size_t kSize>
void Copy(const Vector& from, double (&to)[kSize]) {
  for (size_t i = 0; i < kSize; ++i) to[i] = from[static_cast<Eigen::Index>(i)];
}

// An array of C as a vector. Throws InputError for a null pointer with a count.
template <typename To, typename From, typename Convert>
std::vector<To> VectorOf(const From* elements, size_t count, Convert&& convert) {
  if (count > 0 && !elements) throw InputError("an array that has elements is NULL");
  std::vector<To> vector;
  for (size_t i = 0; i < count; ++i) vector.push_back(convert(elements[i]));
  return vector;
}

// Writes at most `most` elements; `count` becomes the number written.
template <typename From, typename To, typename Convert>
void Write(const std::vector<From>& from, To* to, size_t most, size_t* count, Convert&& convert) {
  *count = to ? std::min(most, from.size()) : 0;
  for (size_t i = 0; i < *count; ++i) to[i] = convert(from[i]);
}

// As Write; where `to` is NULL, `count` becomes the number of all elements.
template <typename From, typename To, typename Convert>
void WriteOrCount(const std::vector<From>& from, To* to, size_t most, size_t* count,
                  Convert&& convert) {
  Write(from, to, most, count, convert);
  if (!to) *count = from.size();
}

Eigen::Vector3d PointOf(const double (&numbers)[3]);
std::string TextOf(const char* text);  // NULL: empty
oaslam_status StatusOf(const AnchorReport& report);

oaslam_pose PoseOf(const Rigid3& pose);
std::optional<Rigid3> PoseOf(const oaslam_pose* pose);  // NULL: nothing
Camera CameraOf(const oaslam_camera& camera);
oaslam_camera CameraOf(const Camera& camera);
// An image that refers to the bytes `pixels`, which are not copied. Throws InputError.
cv::Mat PixelsOf(const uint8_t* pixels, int32_t width, int32_t height, int32_t channels,
                 size_t bytes_per_row);
Detection DetectionOf(const oaslam_detection& detection);
ImageInput InputOf(const oaslam_image& image);
oaslam_imu_calibration CalibrationOf(const ImuCalibration& imu);
oaslam_result ResultOf(const TrackingResult& result);
RelocalizeOptions OptionsOf(const oaslam_relocalize_options* options);  // NULL: the defaults
oaslam_relocalization RelocalizationOf(const RelocalizationResult& result);
oaslam_ray_hit HitOf(const RayHit& hit);
oaslam_event EventOf(const SlamEvent& event);
oaslam_stamped_pose StampedPoseOf(const StampedPose& pose);
oaslam_tracked_point TrackedPointOf(const TrackedPoint& point);
oaslam_object_presence PresenceOf(const ObjectPresence& presence);
ObjectEdit EditOf(const oaslam_object_edit& edit);

}  // namespace oaslam::c
