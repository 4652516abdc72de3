#include "oaslam/recordings/containers.h"
#include "recording.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return oaslam::fuzz::ReadRecording(oaslam::kSqliteMagic, oaslam::fuzz::Text(data, size));
}
