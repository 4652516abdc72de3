#include "oaslam/util/check.h"

#include <stdexcept>
#include <string>

namespace oaslam {

void CheckFailed(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string(file) + ":" + std::to_string(line) +
                         ": broken invariant: " + condition);
}

}  // namespace oaslam
