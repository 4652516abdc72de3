#pragma once

// OASLAM_API marks what the library defines for applications: a function, or a class whose members
// it defines. All else stays inside the shared library. Functions and types that are complete in
// their header need it only where an exception of the type is thrown across the boundary. The
// static library (OASLAM_STATIC, set by its CMake target and by nobody else) has no such boundary.
// OASLAM_LOCAL, where a class inside such a class is defined (`class OASLAM_LOCAL Slam::Impl`),
// keeps that inside the library.
#if defined(__GNUC__) && !defined(OASLAM_STATIC)
#define OASLAM_API __attribute__((visibility("default")))
#define OASLAM_LOCAL __attribute__((visibility("hidden")))
#else
#define OASLAM_API
#define OASLAM_LOCAL
#endif
