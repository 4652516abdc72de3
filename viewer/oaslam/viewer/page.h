#pragma once

#include <string_view>

namespace oaslam {

// The viewer's page, one self-contained HTML document: web/dist/index.html, compressed by gzip -n
// and made part of the program by the build.
std::string_view ViewerPage();

}  // namespace oaslam
