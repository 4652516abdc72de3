#pragma once

#include <string_view>

namespace oaslam {

// The page for phones, one self-contained HTML document: web/dist/camera.html, compressed by
// gzip -n and made part of the program by the build.
std::string_view CameraPage();

}  // namespace oaslam
