#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/service/georeference.h"

namespace oaslam {

// The GeoPose protocol of Open AR Cloud, version 2 candidate 1
// (github.com/OpenArCloud/oscp-geopose-protocol): a request with readings of a device's sensors,
// and the pose of its camera as the answer. Readings of Wi-Fi and Bluetooth are ignored, and so are
// those of motion sensors, since the protocol does not relate their axes to the camera's.

struct GeoPoseImage {
  enum class Format { kFile, kGray8, kRgba32 };
  std::string sensor;
  double time_ms = 0;             // since 1970
  Format format = Format::kFile;  // a JPEG or PNG file, or the rows of pixels alone
  int width = 0, height = 0;      // as the request says; 0: it does not, and the format is kFile
  std::string bytes;
  std::optional<Camera> camera;  // without one it is to be estimated
};

struct GeoPoseRequest {
  std::string id;
  double time_ms = 0;                   // since 1970
  std::vector<GeoPoseImage> images;     // at least one, in the order of the request
  std::optional<GeoPosition> location;  // where the device believes to be; the newest reading
  std::optional<double> accuracy_m;     // of the location
  std::vector<GeoPose> prior_poses;     // of the device's camera before, in the request's order
};

// Reads a GeoPoseReq with at most `max_images` images. Throws InputError that names the place of
// what is wrong.
GeoPoseRequest ReadGeoPoseRequest(const std::string& text, size_t max_images);

struct GeoPoseAnswer {
  std::string id;      // of the request
  double time_ms = 0;  // of the image
  GeoPose pose;
  // Standard deviations, each the mean of three components.
  double position_m = 0, orientation_deg = 0;
};

// A GeoPoseResp.
std::string WriteGeoPoseAnswer(const GeoPoseAnswer& answer);

}  // namespace oaslam
