#pragma once

#include <string_view>

namespace oaslam {

// The page for phones, one self-contained HTML document: web/dist/camera.html, compressed by
// gzip -n and made part of the program by the build.
std::string_view CameraPage();

// The odometry that this page runs: web/dist/oaslam_odometry.wasm, compressed likewise.
std::string_view OdometryModule();

// The description of the service, OpenAPI 3.1: data/openapi.json, compressed by gzip -n and made
// part of the program by the build.
std::string_view OpenApi();

}  // namespace oaslam
