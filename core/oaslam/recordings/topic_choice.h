#pragma once

#include <string>

#include "oaslam/recordings/recording_summary.h"

namespace oaslam {

// Which topics of a recording are used. A topic of images and its compressed form (its name with
// "/compressed") count as one.

// The topic of images: that of the name `asked`, or the only one. Throws InputError, which lists
// the topics, where there is none, or more than one and no name.
const TopicSummary& ChooseImages(const RecordingSummary& summary, const std::string& asked);

// The CameraInfo of a topic of images or depths: camera_info beside it, as image_transport names
// it, else the only one of the same frame. Null: there is none.
const TopicSummary* InfoOf(const RecordingSummary& summary, const TopicSummary& images);
// Whether the images of a topic are rectified, by its name (image_rect...).
bool IsRectified(const TopicSummary& images);
// The camera of a topic of images or depths, by its CameraInfo; nothing where none is calibrated.
// Throws InputError.
std::optional<Camera> CameraOf(const RecordingSummary& summary, const TopicSummary& images);

// Images of a depth camera: 16UC1 in millimetres, 32FC1 in metres.
bool IsDepth(const TopicSummary& topic);
// The topic of depths for these images: one of the same frame, which is registered to them, else
// the only one with a CameraInfo whose frame /tf_static ties to that of the images. Null: there is
// none, or several.
const TopicSummary* ChooseDepths(const RecordingSummary& summary, const TopicSummary& images);

// The topics of an IMU: one that measures both, or one for each sensor; null: not there. Several
// IMUs: none.
struct ImuTopics {
  const TopicSummary *gyroscope = nullptr, *accelerometer = nullptr;
};
ImuTopics ChooseImu(const RecordingSummary& summary);

// The topics, a line each, with types, numbers and rates.
std::vector<std::string> TopicLines(const RecordingSummary& summary);

}  // namespace oaslam
