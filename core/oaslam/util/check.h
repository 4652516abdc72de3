#pragma once

namespace oaslam {

[[noreturn]] void CheckFailed(const char* condition, const char* file, int line);

}  // namespace oaslam

// Checks an invariant of this library, never input: throws std::logic_error, which names the place,
// where the condition is false.
#define OASLAM_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::oaslam::CheckFailed(#condition, __FILE__, __LINE__))
