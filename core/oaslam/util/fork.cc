#include "oaslam/fork.h"

#include <pthread.h>

#include <atomic>

namespace oaslam {
namespace {

std::atomic<int> forks_before = 0;

}  // namespace

ForkError::ForkError()
    : std::runtime_error(
          "this object was made before the process was forked, and its threads and open files are "
          "only in the parent: the child has to make its own") {}

int ForksBefore() {
  // Registered by the first object that asks, also one that is made before main.
  static const int registered = pthread_atfork(nullptr, nullptr, [] { ++forks_before; });
  if (registered != 0) throw std::bad_alloc();
  return forks_before;
}

}  // namespace oaslam
