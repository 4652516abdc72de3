#include "detection_choice.h"

#include <spdlog/spdlog.h>

namespace oaslam::apps {

DetectionFile LoadDetectionsFor(const std::string& path, const CommonOptions& common) {
  return WithClassesInUse(ReadDetectionFile(path), path, common);
}

DetectionFile WithClassesInUse(DetectionFile file, const std::string& path,
                               const CommonOptions& common) {
  if (!common.classes.empty()) {
    file.categories.clear();
    return file;
  }
  if (!file.categories.empty()) {
    if (RenumberByName(file.categories, CocoClassNames(), file.images)) file.categories.clear();
    return file;
  }
  if (common.category_ids == "coco91") {
    Renumber91To80(file.images);
  } else if (file.is_coco && common.category_ids.empty()) {
    const CocoNumbers numbers = NumbersOf(file.images);
    if (numbers == CocoNumbers::k91) {
      spdlog::info("{}: its categories are COCO's 91 numbers, taken as 0 to 79", path);
      Renumber91To80(file.images);
    } else if (numbers == CocoNumbers::kUnclear) {
      spdlog::warn(
          "{}: its categories may be COCO's 91 numbers, but are taken as 0 to 79: --category-ids "
          "coco91, or coco80 if they are",
          path);
    }
  }
  return file;
}

}  // namespace oaslam::apps
