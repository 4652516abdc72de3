#include "../../command/program/gravity_file.h"
#include "fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  return fuzz::Try([&] {
    apps::GravityTrack track =
        apps::GravityTrack::Load(fuzz::FileOf(fuzz::Text(data, size), "gravity.txt"));
    for (const double time : {-1.0, 0.0, 0.5, 1e9}) track.At(time);
  });
}
