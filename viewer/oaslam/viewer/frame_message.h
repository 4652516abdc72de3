#pragma once

#include <span>

#include "oaslam/class_names.h"
#include "oaslam/viewer/frame_record.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// Adds a frame: header.frame, its key points and its picture (JPEG, may be empty) as arrays.
// Coordinates are pixels of the ideal image: boxes are areas, centres of ellipses and key points
// are pixel coordinates.
void AddFrame(const FrameRecord& record, const ClassNames& names, std::span<const uint8_t> jpeg,
              MessageBuilder& message);

}  // namespace oaslam
