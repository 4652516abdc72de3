#pragma once

#include <atomic>
#include <memory>
#include <stdexcept>
#include <utility>

#include "casters.h"
#include "gil.h"
#include "oaslam/fork.h"

namespace oaslam::python {

// Allows one call at a time.
class Turn {
 public:
  struct Flag {
    std::atomic<bool> is_used = false;
    const int forks_before = ForksBefore();
  };

  // Throws ForkError where a call was under way when a parent process forked, and
  // std::runtime_error with this message where one is under way in this process.
  Turn(Flag& flag, const char* message) : flag_(flag) {
    if (!flag_.is_used.exchange(true)) return;
    if (flag_.forks_before != ForksBefore()) throw ForkError();
    throw std::runtime_error(message);
  }
  ~Turn() { flag_.is_used = is_kept_; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  // No other call is allowed any more.
  void Keep() { is_kept_ = true; }

 private:
  Flag& flag_;
  bool is_kept_ = false;
};

// An object that allows one call at a time. Its functions and its destructor run without Python's
// lock, since threads of the library may need that to finish. Calls of other Python threads
// meanwhile get RuntimeError.
template <typename T>
class Exclusive {
 public:
  template <typename... Args>
  explicit Exclusive(Args&&... args) : value_(std::forward<Args>(args)...) {}

  template <typename Function>
  auto Use(Function&& function) {
    const Turn turn(is_used_, kAtWork);
    const WithoutPythonsLock without_gil;
    return function(value_);
  }
  // Within Use of another object, which has released Python's lock.
  template <typename Function>
  auto UseToo(Function&& function) {
    const Turn turn(is_used_, kAtWork);
    return function(value_);
  }

 private:
  static constexpr const char* kAtWork =
      "this object is at work for another call, and takes one at a time";

  Turn::Flag is_used_;
  T value_;
};

struct DeleteWithoutGil {
  template <typename T>
  void operator()(T* object) const {
    if (PyGILState_Check()) {
      const WithoutPythonsLock released;
      delete object;
    } else {
      delete object;
    }
  }
};

// Constructed and deleted without Python's lock.
template <typename T, typename... Args>
std::shared_ptr<T> MakeWithoutGil(Args&&... args) {
  const WithoutPythonsLock without_gil;
  return std::shared_ptr<T>(new T(std::forward<Args>(args)...), DeleteWithoutGil());
}

// A member function of T as one of Exclusive<T>.
template <typename T, typename Result, typename... Args>
auto Method(Result (T::*function)(Args...)) {
  return [function](Exclusive<T>& object, Args... args) -> Result {
    return object.Use(
        [&](T& value) -> Result { return (value.*function)(std::forward<Args>(args)...); });
  };
}
template <typename T, typename Result, typename... Args>
auto Method(Result (T::*function)(Args...) const) {
  return [function](Exclusive<T>& object, Args... args) -> Result {
    return object.Use(
        [&](T& value) -> Result { return (value.*function)(std::forward<Args>(args)...); });
  };
}

}  // namespace oaslam::python
