#include "oaslam/viewer/frame_record_of.h"

#include "oaslam/system/slam_access.h"

namespace oaslam {

FrameRecord FrameRecordOf(const Slam& slam, const TrackingResult& result, const cv::Mat& image) {
  FrameRecord record;
  record.note = {result.frame, result.timestamp, result.state, result.inliers, result.ms_total};
  record.world_from_cam = result.world_from_cam;
  record.keypoints = result.keypoints;
  record.matched = result.matched;
  record.objects = result.objects;
  record.confidence = result.confidence;
  record.ms_features = result.ms_features;
  record.ms_track = result.ms_track;
  record.ms_objects = result.ms_objects;
  record.view = SlamAccess::View(slam);
  record.image = image;
  return record;
}

}  // namespace oaslam
