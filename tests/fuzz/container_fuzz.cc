#include "fuzz.h"
#include "oaslam/images/video_container.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  oaslam::SilenceFfmpeg();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string path = fuzz::FileOf(fuzz::Text(data, size), "video.mp4");
  ReadVideoTag(path, "focal_length.35mm_equivalent");
  return fuzz::Try([&] {
    const VideoContainer container = ReadVideoContainer(path);
    for (size_t i = 0; i < container.times.seconds.size(); ++i)
      TimeIndexOf(container.times, i, container.times.seconds[i]);
  });
}
