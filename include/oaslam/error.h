#pragma once

#include <stdexcept>
#include <string>

namespace oaslam {

// Bad input at the edge: a file, a configuration, a calibration, a detection. One line that names
// path, key, value and bound.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace oaslam
