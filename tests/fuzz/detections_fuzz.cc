#include "fuzz.h"
#include "oaslam/detection_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  return fuzz::Try(
      [&] { LoadDetections(fuzz::FileOf(fuzz::Text(data, size), "detections.json")); });
}
