#pragma once

#include <initializer_list>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/formats/lens_models.h"
#include "oaslam/formats/yaml.h"

namespace oaslam {

using CameraKeys = std::initializer_list<const char*>;

// A mapping of a calibration file, and its path for messages. Whatever it throws is an InputError.
struct CameraReader {
  std::string path;
  YAML::Node root;
  cv::Size image_size{};  // of the images that it is for; {0, 0}: not known
  std::string prefix{};   // of keys in messages

  // The first of the keys that exists, with its value.
  std::optional<std::pair<std::string, YAML::Node>> Find(CameraKeys keys) const;
  std::pair<std::string, YAML::Node> Need(CameraKeys keys) const;
  double Number(CameraKeys keys) const;
  double NumberOr(const std::string& key, double fallback) const;
  std::vector<double> NumbersOf(CameraKeys keys, double fallback) const;
  // A list, a list of rows, or a matrix as a mapping with "data". `count`: how many, 0 for any.
  std::vector<double> Numbers(CameraKeys keys, size_t count = 0) const;
  std::string Text(CameraKeys keys) const;
  // The mapping below a key.
  CameraReader Below(const char* key) const;
  LensPlace Place(const std::string& key) const { return {path, key, image_size}; }

  void ReadSize(Camera& camera, CameraKeys width, CameraKeys height) const;
  // [width, height]
  void ReadSizeList(Camera& camera, const char* list) const;
  void ReadFocal(Camera& camera, CameraKeys fx, CameraKeys fy, CameraKeys cx, CameraKeys cy) const;
  // Refuses every key that is neither in `known` (words separated by blanks) nor begins with one of
  // `rest`, since an unknown key could be about the lens.
  void CheckKeys(std::string_view known, CameraKeys rest = {}) const;
  // Refuses values other than 0 for keys that the model does not have.
  void CheckZero(CameraKeys keys, const std::string& model) const;
};

// The mapping that a calibration is: YAML, JSON, or the XML of OpenCV. Of a transforms.json with a
// camera for each frame, that with the median focal length, among those for images of this size.
YAML::Node ParseCameraFile(const std::string& text, const std::string& path,
                           const cv::Size& image_size = {});

}  // namespace oaslam
