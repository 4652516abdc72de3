#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <functional>

namespace oaslam {

// Calls a function in a forked child, which then ends as a program does. Returns whether it was
// true; false also where the child hangs, and is killed after five minutes.
inline bool HoldsInChild(const std::function<bool()>& function) {
  std::fflush(nullptr);  // else the child would write the same again
  const pid_t child = fork();
  if (child == 0) {
    alarm(300);  // far longer than on a busy machine
    const int status = function() ? 0 : 1;
#ifdef __SANITIZE_ADDRESS__
    std::_Exit(status);  // what belongs to the parent is left alone, which looks like a leak
#else
    std::exit(status);
#endif
  }
  int status = -1;
  return waitpid(child, &status, 0) == child && status == 0;
}

}  // namespace oaslam
