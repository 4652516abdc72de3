#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

struct SavedMap;

// A film or a folder of images that a map was made of, or continued with. The frames of a map are
// numbered through all its recordings, so that the number of a frame tells its recording; its time
// does not, since each recording may begin at 0 s.
struct MapRecording {
  std::string name;     // empty: not known
  std::string images;   // where they were; empty: not known, or a camera
  int first_frame = 0;  // it has the frames from this on, up to the next recording's
  bool operator==(const MapRecording&) const = default;
};

// Ascending by first frame. A map without any is of one that is not known.
using MapRecordings = std::vector<MapRecording>;

// The place of the recording that has a frame.
size_t RecordingOf(const MapRecordings& recordings, int frame_index);

// As messages name it: `2 (walk)`, or `2` without a name.
std::string Describe(const MapRecordings& recordings, size_t recording);
// `1 (walk), 2 (kitchen)`.
std::string Describe(const MapRecordings& recordings);
// A name for its files, unlike that of any other: `2-walk`, in letters, digits, `.`, `_` and `-`.
std::string FileNameOf(const MapRecordings& recordings, size_t recording);

// The place of the recording that a user names by its number from 1, or by its name. Throws
// InputError where there is none, or several have this name.
size_t FindRecording(const MapRecordings& recordings, std::string_view number_or_name);

// The recordings of a map that does not name them: another begins where time goes back.
MapRecordings RecordingsByTime(const SavedMap& saved);

// The map with keyframes and frames of one recording only, and with the landmarks that at least two
// of these keyframes see. Throws InputError where it has no keyframe.
SavedMap OfRecording(const SavedMap& saved, size_t recording);

}  // namespace oaslam
