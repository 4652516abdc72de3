#include <fmt/format.h>

#include "oaslam/util/check.h"
#include "oaslam/util/log.h"

// Throws an exception of JavaScript, which passes through this code.
__attribute__((import_module("oaslam"), import_name("fail"))) extern "C" [[noreturn]] void
OaslamFail(const char* text);

namespace oaslam {

// Instead of that in util/check.cc: without the exceptions of C++ the module is smaller and faster.
void CheckFailed(const char* condition, const char* file, int line) {
  OaslamFail(fmt::format("{}:{}: broken invariant: {}", file, line, condition).c_str());
}

// Instead of that in util/log.cc: only depths that are wrong are said, and a page gives none.
void Log(LogLevel, const std::string&) {}

}  // namespace oaslam
