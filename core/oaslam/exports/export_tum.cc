#include <fmt/format.h>

#include <algorithm>

#include "oaslam/exports/map_export.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

void ExportTum(const std::string& path, const SavedMap& saved) {
  std::vector<std::vector<StampedPose>> all = FinalTrajectories(saved);
  std::erase_if(all, [](const auto& poses) { return poses.empty(); });
  std::ranges::stable_sort(all, {}, [](const auto& poses) { return poses.front().timestamp; });
  std::vector<StampedPose> joined;
  for (const std::vector<StampedPose>& poses : all) {
    if (!joined.empty() && poses.front().timestamp <= joined.back().timestamp)
      throw BadInput(
          "{}: the map is of {} recordings whose times overlap: {}. Export "
          "one of them (--recording), or to a folder, which gets a file of each",
          path, saved.recordings.size(), Describe(saved.recordings));
    joined.insert(joined.end(), poses.begin(), poses.end());
  }
  SaveTrajectory(path, joined);
}

void ExportTumFiles(const std::string& folder, const SavedMap& saved) {
  const std::vector<std::vector<StampedPose>> all = FinalTrajectories(saved);
  for (size_t i = 0; i < all.size(); ++i)
    if (!all[i].empty())
      SaveTrajectory(fmt::format("{}/{}.txt", folder, FileNameOf(saved.recordings, i)), all[i]);
}

}  // namespace oaslam
