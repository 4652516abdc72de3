#pragma once

#include <cstddef>
#include <string>

namespace oaslam {

// Reads a whole file. Throws InputError, which names the file, when it cannot be read or has more
// than `max_bytes`: a device may have no end.
std::string ReadFile(const std::string& path, size_t max_bytes);

}  // namespace oaslam
