#pragma once

#include <stdexcept>
#include <string>

#include "oaslam/export.h"

namespace oaslam {

// Bad input, such as a file, a configuration, a calibration or a detection. The message has one
// line for each problem (more than one only for configurations), which names path, key, value and
// bound:
//
//   try {
//     slam.Load("room.map");
//   } catch (const InputError& error) {
//     std::cerr << error.what() << "\n";
//   }
class OASLAM_API InputError : public std::runtime_error {
 public:
  // `message`: what is wrong, and where.
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace oaslam
