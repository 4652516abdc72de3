#pragma once

#include <atomic>
#include <memory>
#include <stdexcept>
#include <utility>

#include "casters.h"
#include "gil.h"

namespace oaslam::python {

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
    const Turn turn(is_used_);
    const WithoutPythonsLock without_gil;
    return function(value_);
  }
  // Within Use of another object, which has released Python's lock.
  template <typename Function>
  auto UseToo(Function&& function) {
    const Turn turn(is_used_);
    return function(value_);
  }

 private:
  class Turn {
   public:
    explicit Turn(std::atomic<bool>& is_used) : is_used_(is_used) {
      if (is_used_.exchange(true))
        throw std::runtime_error(
            "this object is at work for another call, and takes one at a time");
    }
    ~Turn() { is_used_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    std::atomic<bool>& is_used_;
  };

  std::atomic<bool> is_used_ = false;
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
