#include "fuzz.h"
#include "oaslam/image_source.h"

// Metadata of an image file. The pixels are decoded by OpenCV, as for every image.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  static const TempFolder folder;
  std::ofstream(folder / "0.jpg", std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  FocalLength35mm(folder.path());
  return 0;
}
