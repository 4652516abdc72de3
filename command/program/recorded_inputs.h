#pragma once

#include <string>
#include <vector>

#include "common.h"
#include "detector_options.h"
#include "oaslam/recordings/recording_summary.h"

namespace oaslam::apps {

struct SideFiles;

// What a recording of ROS may give besides images, where it is not given otherwise.
struct FromRecording {
  std::string* camera;         // as given
  SideFiles* side;             // what is taken is put there
  DetectorSettings* detector;  // none, if there are detections; null: it was asked for
};

// Takes it, if the images are those of a recording, and says in one line what was taken. `imu` and
// `depth` of the side files may name topics of it. Throws InputError.
void TakeRecording(const std::string& images, const CommonOptions& common,
                   const FromRecording& into);

// What TakeRecording takes of a recording, for `oaslam info`: a line each.
std::vector<std::string> TakenLines(const RecordingSummary& summary);

}  // namespace oaslam::apps
