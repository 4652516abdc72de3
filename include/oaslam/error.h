#pragma once

#include <stdexcept>
#include <string>

#include "oaslam/export.h"

namespace oaslam {

// Bad input, such as a file, a configuration, a calibration or a detection. The message is one line
// that names path, key, value and bound.
class OASLAM_API InputError : public std::runtime_error {
 public:
  // `message`: one line.
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace oaslam
