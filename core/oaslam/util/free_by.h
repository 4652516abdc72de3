#pragma once

namespace oaslam {

// The deleter of an object of a library in C. `kFree` takes the object or, as FFmpeg's functions
// do, the address of the pointer to it.
template <auto kFree>
struct FreeBy {
  template <typename T>
  void operator()(T* object) const {
    if constexpr (requires { kFree(&object); })
      kFree(&object);
    else
      kFree(object);
  }
};

}  // namespace oaslam
