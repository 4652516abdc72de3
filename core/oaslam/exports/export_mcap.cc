#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "oaslam/exports/map_export.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/exports/result_topics.h"
#include "oaslam/formats/unfinished_file.h"

namespace oaslam {
namespace {

void WriteMcap(const SavedMap& saved, ResultTopics& topics) {
  topics.SetMapFromWorld({RosFromWorld(saved.map), {0, 0, 0}});
  std::vector<std::vector<StampedPose>> all = FinalTrajectories(saved);
  double begin = std::numeric_limits<double>::infinity();
  for (const std::vector<StampedPose>& poses : all)
    if (!poses.empty()) begin = std::min(begin, poses.front().timestamp);
  topics.AddMap(begin, saved.map, saved.class_names);
  for (size_t i = 0; i < all.size(); ++i) {
    const std::string place = all.size() > 1 ? fmt::format("recording_{}/", i + 1) : "";
    topics.AddPath(begin, topics.AddPathTopic("/oaslam/" + place + "path"), all[i]);
    for (const StampedPose& pose : all[i])
      topics.AddTransform(pose.timestamp, place + kCameraFrame, pose.world_from_cam);
  }
  topics.Finish();
}

}  // namespace

void ExportMcap(const std::string& path, const SavedMap& saved) {
  ReplaceFile(path, [&](const std::string& written) {
    ResultTopics topics(written, path);
    WriteMcap(saved, topics);
  });
}

}  // namespace oaslam
