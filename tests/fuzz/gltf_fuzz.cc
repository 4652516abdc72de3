#include "fuzz.h"
#include "oaslam/content/model_library.h"

// A .gltf of a user, whose references are followed before it is served.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  return fuzz::Try([&] { ModelLibrary({fuzz::FileOf(fuzz::Text(data, size), "model.gltf")}); });
}
