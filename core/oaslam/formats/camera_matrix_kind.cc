#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "oaslam/formats/camera_kinds.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// Whether a key that is not known could be about the lens: it names a part of it, or is nearly a
// known key.
bool MayBeAboutLens(const std::string& key, const std::vector<std::string_view>& known) {
  const std::string word = Lower(key);
  for (const char* part : {"dist", "lens", "model", "fisheye", "coef", "focal", "xi", "resolution"})
    if (word == part || (word.size() > 3 && std::string_view(part).size() > 2 &&
                         word.find(part) != std::string::npos))
      return true;
  constexpr size_t kLong = 5;  // shorter keys are near to many words
  return std::ranges::any_of(known, [&](std::string_view other) {
    return word.size() >= kLong && EditDistance(word, Lower(other)) <= 2;
  });
}

constexpr CameraKeys kMatrixKeys = {
    "camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K", "k", "M1", "mtx"};
constexpr CameraKeys kCoefficientKeys = {"distortion_coefficients",
                                         "Distortion_Coefficients",
                                         "distCoeffs",
                                         "dist_coeffs",
                                         "dist_coeff",
                                         "DistCoeffs",
                                         "distortionCoefficients",
                                         "D",
                                         "d",
                                         "D1",
                                         "dist"};
constexpr CameraKeys kWidthKeys = {"image_width", "image_Width", "imageWidth", "width"},
                     kHeightKeys = {"image_height", "image_Height", "imageHeight", "height"};
// Of ROS and of OpenCV's calibration program, besides; `mask` is ours (camera_mask).
constexpr std::string_view kOtherMatrixKeys =
    "camera_name distortion_model fisheye_model rectification_matrix projection_matrix header R P "
    "binning_x binning_y roi calibration_time flags flag_value nframes nr_of_frames nrOfFrames "
    "avg_reprojection_error Avg_Reprojection_Error per_view_reprojection_errors "
    "Per_View_Reprojection_Errors rms reprojection_error mask";

// Files of OpenCV hold whatever their writers added: what cannot be about the lens is only named.
void CheckMatrixKeys(const CameraReader& reader) {
  std::vector<std::string_view> known = SplitFields(kOtherMatrixKeys);
  for (const CameraKeys keys : {kMatrixKeys, kCoefficientKeys, kWidthKeys, kHeightKeys})
    known.insert(known.end(), keys.begin(), keys.end());
  std::vector<std::string> unused;
  for (const auto& entry : reader.root) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    if (std::ranges::find(known, key) != known.end()) continue;
    if (MayBeAboutLens(key, known))
      throw BadInput(
          "{}: {}: {}, a key that is not understood; if it says nothing about lens and image size, "
          "remove the line",
          reader.path, key, TextOfNode(entry.second));
    unused.push_back(key);
  }
  if (!unused.empty())
    Log(LogLevel::kInfo, "{}: keys that are not used: {}", reader.path, fmt::join(unused, ", "));
}

// A message of ROS tells of images that are parts of what the calibration is for.
void CheckWholeImage(const CameraReader& reader) {
  for (const char* key : {"binning_x", "binning_y"})
    if (const double binning = reader.NumberOr(key, 0); binning > 1)
      throw BadInput("{}: {}: {}, allowed: 0 or 1", reader.path, key, binning);
  const auto roi = reader.Find({"roi"});
  if (!roi || !roi->second.IsMap()) return;
  const CameraReader part = reader.Below("roi");
  for (const char* key : {"x_offset", "y_offset"})
    if (const double offset = part.NumberOr(key, 0); offset != 0)
      throw BadInput("{}: roi.{}: {}, allowed: 0", reader.path, key, offset);
}

}  // namespace

bool HasCameraMatrix(const CameraReader& reader) { return reader.Find(kMatrixKeys).has_value(); }

Camera ReadMatrixKind(const CameraReader& reader) {
  CheckMatrixKeys(reader);
  CheckWholeImage(reader);
  Camera camera;
  reader.ReadSize(camera, kWidthKeys, kHeightKeys);
  const auto matrix_key = reader.Need(kMatrixKeys).first;
  const auto k = reader.Numbers(kMatrixKeys, 9);
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    throw BadInput("{}: {}: [{}], expected [fx 0 cx 0 fy cy 0 0 1]", reader.path, matrix_key,
                   fmt::join(k, " "));
  camera.fx = k[0], camera.cx = k[2], camera.fy = k[4], camera.cy = k[5];
  if (const auto name = reader.Find({"camera_name"}); name && name->second.IsScalar())
    camera.name = name->second.Scalar();
  if (reader.Find({"distortion_model"}))
    camera.model = LensModelOf(reader.Text({"distortion_model"}), reader.Place("distortion_model"));
  if (reader.NumberOr("fisheye_model", 0) != 0) camera.model = LensModel::kFisheye;
  if (const auto found = reader.Find(kCoefficientKeys))
    SetDistortion(camera, reader.Numbers(kCoefficientKeys), reader.Place(found->first));
  return camera;
}

}  // namespace oaslam
