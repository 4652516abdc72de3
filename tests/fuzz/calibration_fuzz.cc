#include "fuzz.h"
#include "oaslam/camera_file.h"

// The first byte chooses the name of the file, which tells its format.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  if (size == 0) return -1;
  constexpr const char* kNames[] = {"camera.yaml", "camera.json", "cameras.txt", "camera.xml"};
  return fuzz::Try([&] {
    const std::string path =
        fuzz::FileOf(fuzz::Text(data + 1, size - 1), kNames[data[0] % std::size(kNames)]);
    const Camera camera = LoadCamera(path, {640, 480});
    CheckCalibration(camera, path);
    CameraText(camera, "");
  });
}
