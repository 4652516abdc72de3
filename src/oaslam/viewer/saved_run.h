#pragma once

#include <string>
#include <vector>

#include "oaslam/storage/map_file.h"
#include "oaslam/viewer/frame_record.h"

namespace oaslam {

// A finished run as a page shows it.
struct SavedRun {
  SavedMap saved;
  std::vector<FrameNote> notes;  // of frames.csv where there is one, else of the trajectory
  std::string map_file;          // empty: only what text files tell: objects, keyframes, trajectory
};

// A map file, or a folder that `oaslam run`, `localize` or `map-objects` wrote: its map file where
// one lies in it or is given, else its text files. `piece`: of the map (LeadWithPiece). Throws
// InputError.
SavedRun LoadSavedRun(const std::string& path, const std::string& map_path, int piece = 0);

}  // namespace oaslam
