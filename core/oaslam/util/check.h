#pragma once

namespace oaslam {

[[noreturn]] void CheckFailed(const char* condition, const char* file, int line);

}  // namespace oaslam

// A broken invariant of this library, never bad input: throws std::logic_error, which says where.
#define OASLAM_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::oaslam::CheckFailed(#condition, __FILE__, __LINE__))
