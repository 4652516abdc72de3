#include "fuzz.h"
#include "oaslam/formats/detection_input.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  return fuzz::Try([&] {
    const std::string path = fuzz::FileOf(fuzz::Text(data, size), "detections.json");
    DetectionFile file = ReadDetectionFile(path);
    if (NumbersOf(file.images) != CocoNumbers::k80) Renumber91To80(file.images);
    RenumberByName(file.categories, {{0, "person"}, {41, "cup"}}, file.images);
    MatchedToImages(DetectionTable(std::move(file.images)), {"000000.png", "7.png", "1.50.png"},
                    path);
  });
}
