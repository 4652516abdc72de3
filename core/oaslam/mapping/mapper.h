#pragma once

#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/mapping/background_bundle.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/mapping/map_command.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Applies commands to the map; nothing else writes it.
class Mapper {
 public:
  // `adjust`: the background bundle adjustment after a loop, which tests replace.
  Mapper(const SlamConfig& config, Map map, WindowAdjustment adjust = WindowBundleAdjustment)
      : config_(config),
        map_(std::move(map)),
        adjust_(std::move(adjust)),
        rng_(static_cast<uint64_t>(config.runner.seed)),
        unsettled_keyframes_(map_.keyframes.Ids()),
        undescribed_keyframes_(map_.keyframes.Ids()) {}

  void Apply(const MapCommand& command);

  // A last optimisation over everything.
  void Finish();

  // A snapshot of the map, which shares unchanged memory with later ones.
  std::shared_ptr<const Map> Publish();

 private:
  // ApplyEdit, Insert, Join and CloseLoop return whether keyframes or landmarks that were in the
  // map before have moved.
  bool ApplyEdit(const MapCommand& command);
  bool Insert(const KeyframeInsertion& keyframe, int frame_index);
  bool Join(const JoiningMap& joining, int frame_index);
  bool CloseLoop(KeyframeId keyframe, int frame_index);
  void DescribeNextBefore(KeyframeId end);
  void AdjustInBackground(int frame_index);
  bool IsLive() const { return config_.runner.mode == RunnerMode::kLive; }
  bool AdoptBackgroundBundle(const MapCommand& command);
  void BeginNextWindow(int frame_index);

  SlamConfig config_;
  Map map_;
  WindowAdjustment adjust_;
  Rng rng_;
  std::vector<LandmarkId> recent_landmarks_;
  std::vector<KeyframeId> unsettled_keyframes_;    // PackSettledKeyframes
  std::vector<KeyframeId> undescribed_keyframes_;  // ascending
  LoopDetector loop_detector_;
  KeyframeId last_loop_;                                 // keyframe that closed the last loop
  std::unique_ptr<BackgroundBundle> background_bundle_;  // after a loop
  std::vector<std::vector<KeyframeId>> windows_;         // still to be adjusted, the next one last
  std::jthread ending_;  // stops an adjustment that is no longer needed
};

}  // namespace oaslam
