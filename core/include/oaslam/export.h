#pragma once

// OASLAM_API marks what the library defines for applications: a function, or a class whose members
// it defines. All else is hidden inside the shared library. A class that is defined entirely in its
// header needs the mark only if it is an exception type that the library throws to applications.
// The static library (OASLAM_STATIC, set by its CMake target and by nobody else) has no such
// boundary. OASLAM_LOCAL at the definition of a nested class (`class OASLAM_LOCAL Slam::Impl`)
// hides that class although the outer class has OASLAM_API.
#if defined(__GNUC__) && !defined(OASLAM_STATIC)
#define OASLAM_API __attribute__((visibility("default")))
#define OASLAM_LOCAL __attribute__((visibility("hidden")))
#else
#define OASLAM_API
#define OASLAM_LOCAL
#endif
