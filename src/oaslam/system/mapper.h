#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/command.h"
#include "oaslam/map/map.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/objects/association.h"
#include "oaslam/system/background_bundle.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A map to be added to the one there is (JoinPiece).
struct JoiningMap {
  std::shared_ptr<const Map> map;
  Similarity world_from_map;
};

// What the tracker asks of the mapper after a frame.
struct MapCommand {
  int frame_index = 0;
  uint32_t first_landmark = 0;  // landmarks made from now on have this id or a higher one
  bool settle = false;          // wait for what runs in the background: the map must not move later
  std::optional<ClassRelations> classes;
  std::optional<std::map<std::string, Anchor>> anchors;  // from now on, all of them
  std::optional<InitialMap> initial;
  std::shared_ptr<const Map>
      successor;  // goes on with this map, which was made from the one there is
  std::optional<JoiningMap> joining;
  std::optional<KeyframeInsertion> keyframe;
  std::vector<LandmarkUse> uses;
  std::vector<ObjectSighting> sightings;  // since the command before, in order of frames
};

// The one writer of the map.
class Mapper {
 public:
  Mapper(const SlamConfig& config, Map map)
      : config_(config), map_(std::move(map)), rng_(static_cast<uint64_t>(config.runner.seed)) {}

  void Apply(const MapCommand& command);

  // A last optimisation over everything.
  void Finish();

  // The map as it is now; shares what does not change later.
  std::shared_ptr<const Map> Publish();

 private:
  void Join(const JoiningMap& joining, int frame_index);
  void MapKeyframe(const KeyframeInsertion& keyframe);
  void CloseLoop(KeyframeId keyframe, int frame_index);
  bool AdoptBackgroundBundle(const MapCommand& command);

  SlamConfig config_;
  Map map_;
  Rng rng_;
  std::vector<LandmarkId> recent_landmarks_;
  LoopDetector loop_detector_;
  KeyframeId last_loop_;                               // keyframe that closed the last loop
  std::optional<BackgroundBundle> background_bundle_;  // after a loop
};

}  // namespace oaslam
