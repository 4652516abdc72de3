#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

struct SavedMap;

// A video or a folder of images from which a map was made or extended. The frames of a map are
// numbered through all its recordings, so that the number of a frame tells its recording; its time
// does not, since each recording may begin at 0 s.
struct MapRecording {
  std::string name;     // empty: not known
  std::string images;   // where they were; empty: not known, or a camera
  int first_frame = 0;  // it has the frames from this on, up to the next recording's
  bool operator==(const MapRecording&) const = default;
};

// Ascending by first frame. An empty list means that the map was made from one unknown recording.
using MapRecordings = std::vector<MapRecording>;

// The index in `recordings` of the recording to which a frame belongs.
size_t RecordingOf(const MapRecordings& recordings, int frame_index);

// As messages name it: `2 (walk)`, or `2` without a name.
std::string Describe(const MapRecordings& recordings, size_t recording);
// `1 (walk), 2 (kitchen)`.
std::string Describe(const MapRecordings& recordings);
// A name for the files of a recording, which no other recording has: `2-walk`, of letters, digits,
// `.`, `_` and `-`.
std::string FileNameOf(const MapRecordings& recordings, size_t recording);

// The index of the recording that a user identifies by its number, counted from 1, or by its name.
// Throws InputError where there is none, or several have this name.
size_t FindRecording(const MapRecordings& recordings, std::string_view number_or_name);

// The recordings of a map that does not list them: a new one begins wherever the time stamps
// decrease.
MapRecordings RecordingsByTime(const SavedMap& saved);

// The map with keyframes and frames of one recording only, and with the landmarks that at least two
// of these keyframes see. Throws InputError where it has no keyframe.
SavedMap OfRecording(const SavedMap& saved, size_t recording);

}  // namespace oaslam
