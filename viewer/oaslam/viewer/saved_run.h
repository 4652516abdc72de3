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
  // Empty where there are only text files: objects, keyframes, trajectory.
  std::string map_file;
  std::string images;  // those the map was made of; empty where the folder does not tell it
};

// Loads a map file, or a folder written by `oaslam run`, `localize` or `map-objects`: its map
// file if there is one or it is given, else its text files. `submap`: of the map
// (LeadWithSubmap). Throws InputError.
SavedRun LoadSavedRun(const std::string& path, const std::string& map_path, int submap = 0);

}  // namespace oaslam
