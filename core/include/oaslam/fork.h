#pragma once

#include <memory>
#include <stdexcept>

#include "oaslam/export.h"

namespace oaslam {

// An object was used in a child of fork() that its parent had made before, and whose threads or
// open files the child does not have: a Slam with its SlamStates, a BackgroundDetector, a
// LatestImageSource, a video or camera that OpenImages opened, a MapViewer. The child makes such
// objects of its own. It may destroy those of its parent, which neither waits nor writes; values,
// maps and a MapLocalizer are the child's as well as the parent's:
//
//   const MapSnapshot map = slam.WholeMap();
//   if (fork() == 0) {
//     Slam own(SlamConfig::Live(), camera);
//     own.Load(map);
//   }
class OASLAM_API ForkError : public std::runtime_error {
 public:
  ForkError();
};

// How often this process and its ancestors forked before it began; a child's number is larger than
// that of its parent.
OASLAM_API int ForksBefore();

// Owns an object as std::unique_ptr does, for the process in which it was made: in a forked child
// access throws ForkError, and the object is never destroyed, since its destructor would wait for
// threads that only the parent has.
template <typename T>
class ProcessBound {
 public:
  ProcessBound() = default;
  ProcessBound(std::unique_ptr<T> object) : object_(object.release()) {}  // NOLINT: as unique_ptr

  // Whether this is the process in which it was made.
  bool IsHere() const { return object_.get_deleter().forks == ForksBefore(); }
  // The object; throws ForkError in another process.
  T* operator->() const {
    if (!IsHere()) throw ForkError();
    return object_.get();
  }
  // As above.
  T& operator*() const { return *operator->(); }

 private:
  struct DeleteInItsProcess {
    int forks = ForksBefore();
    void operator()(T* object) const {
      if (forks == ForksBefore()) delete object;
    }
  };
  std::unique_ptr<T, DeleteInItsProcess> object_;
};

}  // namespace oaslam
