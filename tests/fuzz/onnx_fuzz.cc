#include "fuzz.h"
#include "oaslam/detection/onnx_info.h"

// The file itself is read by a library; here it is what we read of it before that.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string_view text = fuzz::Text(data, size);
  ParseNamesMetadata(text);
  const auto info = ParseOnnxInfo(text);
  if (!info) return 0;
  ParseHeadMetadata(info->metadata);
  for (const auto& [key, value] : info->metadata)
    ParseHeadMetadata({{"names", value}, {"args", value}, {"kpt_shape", value}});
  return 0;
}
