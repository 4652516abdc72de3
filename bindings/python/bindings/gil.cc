#include "gil.h"

#include <pthread.h>

#include <condition_variable>
#include <mutex>

namespace oaslam::python {
namespace {

std::mutex mutex;
std::condition_variable at_rest;
int at_work = 0;                    // calls under way; guarded by the mutex, as is the next one
bool is_over = false;               // the interpreter is ending
thread_local int at_work_here = 0;  // those of this thread

// A forked child has only the thread that forked.
[[maybe_unused]] const int fresh_in_a_child =
    pthread_atfork([] { mutex.lock(); }, [] { mutex.unlock(); },
                   [] {
                     at_work = at_work_here;
                     mutex.unlock();
                   });

}  // namespace

PythonCall::PythonCall()
    : is_allowed_([] {
        const std::lock_guard lock(mutex);
        if (is_over) return false;
        ++at_work;
        ++at_work_here;
        return true;
      }()) {}

PythonCall::~PythonCall() {
  if (!is_allowed_) return;
  const std::lock_guard lock(mutex);
  --at_work;
  --at_work_here;
  at_rest.notify_all();
}

void EndPythonCalls() {
  std::unique_lock lock(mutex);
  is_over = true;
  at_rest.wait(lock, [] { return at_work == 0; });
}

}  // namespace oaslam::python
