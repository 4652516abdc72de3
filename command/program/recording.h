#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "frame_inputs.h"
#include "oaslam/images/video_file.h"
#include "oaslam/pictures/ar_picture.h"
#include "oaslam/pictures/ideal_picture.h"
#include "oaslam/slam.h"

namespace oaslam::apps {

struct RecordingSettings {
  std::string path;  // --record, empty: no video

  bool IsAskedFor() const { return !path.empty(); }
};

// Returns --record.
CLI::Option* AddRecordingOptions(CLI::App& app, RecordingSettings& settings);

// Records the video of a run: each image without distortion, with objects, anchors and the path
// drawn into it (docs/recording.md). Without a path all functions do nothing.
class Recording {
 public:
  // Throws InputError where the video's file cannot be written.
  explicit Recording(const RecordingSettings& settings);
  // To be called before the first image.
  void Begin(const Slam& slam, const Camera& camera);

  // Adds an image that was just given to Process, drawn with the map that the tracker saw.
  void Add(const Slam& slam, const FrameInput& frame, const TrackingResult& result);
  // Adds an image that was relocalized, drawn with the map as it was at Begin.
  void Add(const FrameInput& frame, const RelocalizationResult& result);
  // Completes the file. Throws InputError where that fails.
  void Finish();

 private:
  void Add(const FrameInput& frame, ArFrame shown);

  // Of the longer side, pixels; a larger video takes long to encode.
  static constexpr int kMaxSide = 1920;

  Camera camera_;
  IdealPictureMaker pictures_{kMaxSide};
  ClassNames names_;
  Map map_;  // as it was at Begin
  std::optional<VideoFile> video_;
};

}  // namespace oaslam::apps
