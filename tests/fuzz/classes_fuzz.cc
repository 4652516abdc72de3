#include "fuzz.h"
#include "oaslam/class_names.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  return fuzz::Try([&] {
    const Classes classes = LoadClasses(fuzz::FileOf(fuzz::Text(data, size), "classes.yaml"));
    for (const auto& [id, name] : classes.names) NameOf(classes.names, id);
  });
}
