#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "commands.h"
#include "common.h"
#include "metric_scale.h"
#include "oaslam/recordings/topic_choice.h"
#include "oaslam/storage/map_file.h"
#include "recorded_inputs.h"

namespace oaslam::apps {
namespace {

struct ObjectSummary {
  int mapped = 0, candidates = 0;
  std::vector<double> sizes;  // largest diameters of the mapped ones, map units
};

void PrintCameras(const Map& map) {
  for (size_t i = 0; i < map.cameras.size(); ++i) {
    const Camera& c = map.cameras[i];
    fmt::print("camera {}     {}{} x {}, {}{}, fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f}{}\n", i,
               c.name.empty() ? "" : c.name + ", ", c.width, c.height, ToString(c.model),
               c.HasDistortion() ? " with distortion" : "", c.fx, c.fy, c.cx, c.cy,
               c.is_guess ? " (a guess)" : "");
  }
}

void PrintPoints(const Map& map) {
  size_t observations = 0, keypoints = 0;
  map.landmarks.ForEach(
      [&](LandmarkId, const Landmark& landmark) { observations += landmark.observations.size(); });
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    keypoints += keyframe.features->keypoints.size();
  });
  fmt::print("keyframes    {} ({} key points), {} retired\n", map.keyframes.size(), keypoints,
             map.retired.size());
  fmt::print("landmarks    {}, {} observations\n", map.landmarks.size(), observations);
  if (!map.anchors.empty()) fmt::print("anchors      {}\n", map.anchors.size());
}

void PrintRecordings(const SavedMap& saved) {
  struct Span {
    double first = 0, last = 0;
    size_t keyframes = 0;
  };
  std::map<size_t, Span> spans;
  const auto add = [&](int frame, double t) -> Span& {
    Span& span = spans.try_emplace(RecordingOf(saved.recordings, frame), Span{t, t}).first->second;
    span.first = std::min(span.first, t);
    span.last = std::max(span.last, t);
    return span;
  };
  saved.map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    ++add(keyframe.frame_index, keyframe.timestamp).keyframes;
  });
  for (const FramePose& pose : saved.trajectory) add(pose.frame_index, pose.timestamp);
  fmt::print("trajectory   {} frames\n", saved.trajectory.size());
  for (const auto& [i, span] : spans) {
    const std::string images = i < saved.recordings.size() ? saved.recordings[i].images : "";
    fmt::print("recording    {}: {} keyframes, {:.3f} s to {:.3f} s ({:.1f} s){}\n",
               Describe(saved.recordings, i), span.keyframes, span.first, span.last,
               span.last - span.first, images.empty() ? "" : ", images of " + images);
  }
}

void PrintObjects(const SavedMap& saved) {
  std::map<int, ObjectSummary> classes;
  size_t mapped = 0, observations = 0;
  saved.map.objects.ForEach([&](ObjectId, const Object& object) {
    ObjectSummary& summary = classes[object.category_id];
    observations += static_cast<size_t>(object.total_observations);
    if (object.state != ObjectState::kMapped) {
      ++summary.candidates;
      return;
    }
    ++mapped;
    ++summary.mapped;
    summary.sizes.push_back(2 * object.ellipsoid.half_axes.maxCoeff());
  });
  fmt::print("objects      {} mapped, {} candidates, {} observations\n", mapped,
             saved.map.objects.size() - mapped, observations);
  for (auto& [category, summary] : classes) {
    std::ranges::sort(summary.sizes);
    fmt::print("  {:<16} {}", NameOf(saved.class_names, category), summary.mapped);
    if (summary.candidates > 0) fmt::print(" + {} candidates", summary.candidates);
    for (size_t i = 0; i < summary.sizes.size(); ++i)
      fmt::print("{}{:.3g}", i == 0 ? ", diameter " : " ", summary.sizes[i]);
    fmt::print("\n");
  }
}

void PrintRecordedTopics(const std::string& path) {
  const std::shared_ptr<const RecordingSummary> summary = SummaryOf(path);
  fmt::print("recording    {}\n", path);
  for (const std::string& line : TopicLines(*summary)) fmt::print("topic        {}\n", line);
  for (const std::string& line : TakenLines(*summary)) fmt::print("{}\n", line);
}

void PrintInfo(const std::string& given) {
  if (IsRecording(given)) return PrintRecordedTopics(given);
  const std::string path = MapFileAt(given);
  const SavedMap saved = LoadMap(path);
  fmt::print("file         {}, {:.2f} MB\n", path,
             static_cast<double>(std::filesystem::file_size(path)) / 1e6);
  fmt::print("integrity    ok (checksums and invariants verified)\n");
  PrintCameras(saved.map);
  PrintPoints(saved.map);
  PrintRecordings(saved);
  PrintObjects(saved);
  for (size_t i = 0; i < saved.submaps.size(); ++i)
    fmt::print(
        "submap {}      {} keyframes, {} landmarks, {} frames: not joined with the map, in a frame "
        "and unit of its own\n",
        i + 1, saved.submaps[i].map.keyframes.size(), saved.submaps[i].map.landmarks.size(),
        saved.submaps[i].trajectory.size());
  fmt::print("unit         {}\n", DescribeUnit(saved.map));
  if (const auto& up = saved.map.up)
    fmt::print("up           {:.4f} {:.4f} {:.4f} ({})\n", up->x(), up->y(), up->z(),
               saved.map.up_keyframes > 0
                   ? fmt::format("gravity measured in {} keyframes", saved.map.up_keyframes)
                   : "from how the cameras were held");
}

}  // namespace

void AddInfoCommand(CLI::App& app) {
  auto path = std::make_shared<std::string>();
  auto common = std::make_shared<CommonOptions>();
  CLI::App* command = app.add_subcommand(
      "info", "Show what is in a map file, and verify it; or what is in a recording of ROS");
  command->add_option("file", *path, "Map file, or recording of ROS (.mcap, .bag, rosbag2)")
      ->required();
  AddQuietOption(*command, *common);
  command->callback([path, common] { PrintInfo(*path); });
}

}  // namespace oaslam::apps
