#include "oaslam/storage/recordings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <map>

#include "oaslam/storage/map_file.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

void AddTimes(const Map& map, const std::vector<FramePose>& trajectory,
              std::map<int, double>& times) {
  map.keyframes.ForEach(
      [&](KeyframeId, const Keyframe& k) { times.emplace(k.frame_index, k.timestamp); });
  for (const FramePose& pose : trajectory) times.emplace(pose.frame_index, pose.timestamp);
}

}  // namespace

size_t RecordingOf(const MapRecordings& recordings, int frame_index) {
  const auto behind =
      std::ranges::upper_bound(recordings, frame_index, {}, &MapRecording::first_frame);
  return behind == recordings.begin() ? 0 : static_cast<size_t>(behind - recordings.begin()) - 1;
}

std::string Describe(const MapRecordings& recordings, size_t recording) {
  const std::string name = recordings.empty() ? "" : recordings.at(recording).name;
  return name.empty() ? fmt::format("{}", recording + 1)
                      : fmt::format("{} ({})", recording + 1, name);
}

std::string Describe(const MapRecordings& recordings) {
  std::vector<std::string> all;
  for (size_t i = 0; i < recordings.size(); ++i) all.push_back(Describe(recordings, i));
  return fmt::format("{}", fmt::join(all, ", "));
}

std::string FileNameOf(const MapRecordings& recordings, size_t recording) {
  std::string name = recordings.empty() ? "" : recordings.at(recording).name;
  std::ranges::replace_if(
      name,
      [](unsigned char c) {
        return !(c < 128 && std::isalnum(c) != 0) && c != '.' && c != '_' && c != '-';
      },
      '_');
  return name.empty() ? fmt::format("{}", recording + 1)
                      : fmt::format("{}-{}", recording + 1, name);
}

size_t FindRecording(const MapRecordings& recordings, std::string_view number_or_name) {
  std::vector<size_t> found;
  for (size_t i = 0; i < std::max<size_t>(1, recordings.size()); ++i) {
    if (number_or_name == fmt::format("{}", i + 1)) return i;
    if (i < recordings.size() && recordings[i].name == number_or_name) found.push_back(i);
  }
  if (found.size() == 1) return found.front();
  throw BadInput("there {} \"{}\", allowed: the number of one of {}",
                 found.empty() ? "is no recording" : "are several recordings named", number_or_name,
                 recordings.empty() ? "1" : Describe(recordings));
}

MapRecordings RecordingsByTime(const SavedMap& saved) {
  std::map<int, double> times;
  AddTimes(saved.map, saved.trajectory, times);
  for (const Submap& submap : saved.submaps) AddTimes(submap.map, submap.trajectory, times);
  MapRecordings recordings;
  double last = std::numeric_limits<double>::infinity();
  for (const auto& [frame, time] : times) {
    if (time <= last) recordings.push_back({"", "", frame});
    last = time;
  }
  return recordings;
}

SavedMap OfRecording(const SavedMap& saved, size_t recording) {
  SavedMap one = saved;
  const auto is_other = [&](int frame) {
    return RecordingOf(saved.recordings, frame) != recording;
  };
  std::vector<KeyframeId> others;
  saved.map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    if (is_other(keyframe.frame_index)) others.push_back(id);
  });
  if (others.size() == saved.map.keyframes.size())
    throw BadInput("recording {} has no keyframe in this submap",
                   Describe(saved.recordings, recording));
  for (const KeyframeId id : others) one.map.RetireKeyframe(id);
  std::erase_if(one.trajectory, [&](const FramePose& pose) { return is_other(pose.frame_index); });
  one.submaps.clear();
  if (!saved.recordings.empty()) one.recordings = {saved.recordings[recording]};
  return one;
}

}  // namespace oaslam
