#pragma once

#include <string>

namespace oaslam {

// An address without the name and password that it may have, for messages and names of files.
std::string WithoutPassword(const std::string& url);

}  // namespace oaslam
