#pragma once

namespace oaslam {

[[noreturn]] void CheckFailed(const char* condition, const char* file, int line);

}  // namespace oaslam

// Aborts with the place where an invariant of this library is broken. Not for bad input.
#define OASLAM_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::oaslam::CheckFailed(#condition, __FILE__, __LINE__))
