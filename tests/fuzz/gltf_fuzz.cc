#include "fuzz.h"
#include "oaslam/content/mesh_file.h"

// The first byte chooses text (.gltf) or binary (.glb).
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  if (size == 0) return -1;
  const char* name = data[0] % 2 == 0 ? "model.gltf" : "model.glb";
  return fuzz::Try([&] { LoadMesh(fuzz::FileOf(fuzz::Text(data + 1, size - 1), name)); });
}
