#include "fuzz.h"
#include "oaslam/config_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string_view text = fuzz::Text(data, size);
  fuzz::Try([&] {
    SlamConfig config = SlamConfig::Offline();
    ApplySetting(std::string(text), config);
  });
  return fuzz::Try([&] {
    SlamConfig config = SlamConfig::Offline();
    LoadConfig(fuzz::FileOf(text, "config.yaml"), config);
    // What has been read can be written and read again.
    SlamConfig again = SlamConfig::Offline();
    LoadConfig(fuzz::FileOf(ConfigToYaml(config), "again.yaml"), again);
  });
}
