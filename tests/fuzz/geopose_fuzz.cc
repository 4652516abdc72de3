#include "fuzz.h"
#include "oaslam/service/geopose_protocol.h"

// The first byte chooses a request or a georeference.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  if (size == 0) return -1;
  const std::string text(fuzz::Text(data + 1, size - 1));
  if (data[0] % 2 == 0) return fuzz::Try([&] { ReadGeoPoseRequest(text, 4); });
  const GeoreferencedMap map{
      Eigen::Vector3d::UnitZ(), true, {{"a", {Eigen::Quaterniond::Identity(), {1, 2, 3}}}}};
  return fuzz::Try([&] { GeoPoseOfCamera(ReadGeoreference(text, map), Rigid3()); });
}
