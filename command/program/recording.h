#pragma once

#include <CLI/CLI.hpp>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "frame_inputs.h"
#include "oaslam/exports/result_recording.h"
#include "oaslam/images/video_file.h"
#include "oaslam/pictures/ar_picture.h"
#include "oaslam/pictures/ideal_picture.h"
#include "oaslam/slam.h"

namespace oaslam::apps {

struct RecordingSettings {
  std::string path;  // --record, empty: nothing is recorded

  bool IsAskedFor() const { return !path.empty(); }
};

// Returns --record.
CLI::Option* AddRecordingOptions(CLI::App& app, RecordingSettings& settings);

// Records a run: as a video each image without distortion, with objects, anchors and the path drawn
// into it (docs/recording.md), or as MCAP these pictures and all that was found
// (docs/robots.md). Without a path all functions do nothing.
class Recording {
 public:
  // Throws InputError where the file cannot be written, or is what is read: `images`.
  Recording(const RecordingSettings& settings, const std::string& images);
  // To be called before the first image.
  void Begin(const Slam& slam, const Camera& camera);

  // Adds an image that was just given to Process, drawn with the map that the tracker saw.
  void Add(const Slam& slam, const FrameInput& frame, const TrackingResult& result);
  // Adds an image that was relocalized, drawn with the map as it was at Begin.
  void Add(const FrameInput& frame, const RelocalizationResult& result);
  // Completes the file. Throws InputError where that, or the writing of an image to an MCAP file,
  // failed: that ends the recording, not the run.
  void Finish();

 private:
  void Add(const FrameInput& frame, ArFrame shown, RecordedResult result);
  // What happened to the map since the last call.
  std::vector<std::string> NewEvents();
  bool IsOn() const { return video_ || results_; }

  Camera camera_;
  std::optional<IdealPictureMaker> pictures_;
  ClassNames names_;
  Map map_;  // as it was at Begin
  std::optional<SlamStates> states_;
  uint64_t last_event_ = 0;
  std::optional<VideoFile> video_;
  std::optional<ResultRecording> results_;
  std::exception_ptr failure_;
};

}  // namespace oaslam::apps
