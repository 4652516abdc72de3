#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <string>

#include "oaslam/camera.h"
#include "oaslam/geometry/lens_fit.h"

namespace oaslam {

// Lens models of calibration files. The two of LensModel are read as they are. Another model is
// converted to the closest of the two, with a log message, or refused where the conversion is not
// accurate enough.

// The longest side of an image that is read, pixels; CheckCalibration has the bounds.
inline constexpr int kMaxSide = 1'000'000;

// For messages: the file (with a line), the key, and the size of the images, which is used where
// the file has none.
struct LensPlace {
  std::string path, key;
  cv::Size image_size{};
};

// The model of this name, in any spelling of the known tools. Throws InputError.
LensModel LensModelOf(const std::string& name, const LensPlace& place);

// Sets the distortion by coefficients in OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty
// of a pinhole, k1 k2 k3 k4 of a fisheye. The rest of the camera must be set. Throws InputError.
void SetDistortion(Camera& camera, std::span<const double> values, const LensPlace& place);

// Sets the distortion to approximate `lens`, a lens in another model; `name`: of that model, for
// messages.
void SetLens(Camera& camera, const LensFunction& lens, const std::string& name,
             const LensPlace& place);

// Mei and Rives 2007: a unit sphere seen from `xi` behind its centre, then k1 k2 p1 p2.
LensFunction OmniLens(double xi, std::span<const double> radtan);
// Usenko et al. 2018.
LensFunction DoubleSphereLens(double xi, double alpha);
// Khomutenko et al. 2016.
LensFunction ExtendedUnifiedLens(double alpha, double beta);
// Devernay and Faugeras 2001.
LensFunction FieldOfViewLens(double omega);
// COLMAP's THIN_PRISM_FISHEYE: k1 k2 p1 p2 k3 k4 sx1 sy1 on equidistant coordinates.
LensFunction ThinPrismFisheyeLens(std::span<const double> coefficients);
// Nerfstudio's OPENCV: k1 to k4 are the powers 2 to 8 of the radius.
LensFunction FourRadialLens(std::span<const double> k, double p1, double p2);

}  // namespace oaslam
