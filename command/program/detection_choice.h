#pragma once

#include <string>

#include "common.h"
#include "oaslam/formats/detection_input.h"

namespace oaslam::apps {

// The boxes of --detections, their categories numbered as the classes in use are: by the names that
// the file gives (COCO's "categories"), or as --category-ids says. Its `categories` are left empty
// unless they are classes of their own. With --classes all numbers are those of that file. Throws
// InputError.
DetectionFile LoadDetectionsFor(const std::string& path, const CommonOptions& common);

// The same of detections that were read already; `path` tells where.
DetectionFile WithClassesInUse(DetectionFile file, const std::string& path,
                               const CommonOptions& common);

}  // namespace oaslam::apps
