#include "fuzz.h"
#include "oaslam/image_source.h"

// Lists of images: lines with times and paths, or names that are times.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  return fuzz::Try(
      [&] { ListImages(fuzz::FileOf(fuzz::Text(data, size), "list.txt"), {.quiet = true}); });
}
