#include "fuzz.h"
#include "oaslam/formats/detection_input.h"

// The same bytes as JSON, as a table, and as the only text and the only labelme file of a folder.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  static const TempFolder folder;
  for (const char* name : {"detections.json", "boxes.csv", "yolo/0.txt", "labelme/0.json"})
    fuzz::Try([&] {
      const std::string file = folder.Write(name, std::string(fuzz::Text(data, size)));
      const bool is_of_folder = std::string_view(name).find('/') != std::string_view::npos;
      const std::string path = is_of_folder ? file.substr(0, file.rfind('/')) : file;
      DetectionFile found = ReadDetectionFile(path);
      ConvertShares(640, 480, found);
      if (NumbersOf(found.images) != CocoNumbers::k80) Renumber91To80(found.images);
      RenumberByName(found.categories, {{0, "person"}, {41, "cup"}}, found.images);
      MatchedToImages(DetectionTable(std::move(found.images)), {"000000.png", "7.png", "1.50.png"},
                      path);
    });
  return 0;
}
