#pragma once

#include <cmath>
#include <exception>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/joining.h"
#include "oaslam/map/submap.h"
#include "oaslam/relocalization/relocalizer.h"
#include "oaslam/system/session.h"
#include "oaslam/system/submap_link.h"

namespace oaslam {

// A submap of a run: a map with its own frame and unit, and the poses of the frames from which it
// was made. The camera is tracked in it, or it waits until its place in the others is known.
struct AtlasSubmap {
  int number = 0;                    // of a run, each has its own
  std::unique_ptr<Session> session;  // null: it waits
  uint32_t next_keyframe = 0;        // the id of the next new one; of a submap with a session
  // Of one that waits.
  Submap content{};
  Relocalizer relocalizer;  // with an index of its places
  SubmapLink link{};        // poses in it of frames that are tracked in another
  // Time stamp of the last image of this run whose pose it gave; of one of an earlier run: minus
  // infinity.
  double seen_at = -INFINITY;

  bool IsWaiting() const { return !session; }
  // Of one that waits.
  size_t keyframes() const { return content.map.keyframes.size(); }
};

// All submaps of a run, in one container. One is the main submap, in whose frame poses are
// reported; in a second one, which grows, the camera is tracked while it is lost in the main one;
// the others wait. Submaps are joined as soon as enough frames have a pose in both, by points or
// objects. None is dropped. Without mapping, none grows.
// - Once the camera has been lost for a while, a submap begins to grow. The camera is still looked
//   for in the main one.
// - While it is found there by objects only, both are kept up until the transformation between them
//   is known (paper, section "Application to AR": resuming SLAM).
// - Once it is found there by points, both are kept up for half a second more. Then, or where it is
//   lost in the growing submap, too, that one waits.
// - A growing submap takes the place of the main one when it has become larger, while the camera is
//   lost in the main one, or when that is given up, being too small to find the camera again. Where
//   the place of the growing submap in a waiting one is found, while the camera is lost in the main
//   one, the waiting one becomes the main submap and the growing one is joined with it. A main
//   submap that was loaded, has anchors or is in metres keeps its place.
class Atlas {
 public:
  // `is_loaded`: the camera is looked for in `map`, which stays the main submap unless it is empty,
  // and no initial map is made.
  Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Submap> others);

  // Whether the next frame must have features; without them its pose is by its motion since the map
  // was last looked for. `motion`: null as long as it is not known.
  bool NeedsFeatures(double timestamp, const FrameMotion* motion) const;
  // Tracks the next frame.
  TrackingStep Process(const Frame& frame);
  // Detections of a frame that was processed before.
  std::optional<TrackingStep> AddDetections(int frame_index,
                                            const std::vector<ObjectDetection>& detections);
  // Joins the submaps that can be joined, makes the largest one the main one unless that must keep
  // its place, and waits for the last optimisation. Without mapping the map does not change.
  void Finish();
  // The exception that ended the mapping of any submap (MapPipeline); null while mapping works. The
  // caller gives no more frames then. All submaps are kept. Where the mapping of the main one
  // still works, Finish joins the growing one with it if it can, and optimises it. It leaves the
  // waiting ones as they are.
  std::exception_ptr failure();

  void SetRelocalizationMode(RelocalizationMode mode) { mode_ = mode; }
  void SetMapping(bool enabled);
  void ForceRelocalization(const std::optional<Rigid3>& near);
  // Scales the main submap to metres. `by_objects`: as for Session::ScaleToMetres.
  void SetMetresPerUnit(double metres, const std::optional<UnitByObjects>& by_objects = {});
  void SetClassRelations(const ClassRelations& relations);

  bool IsInitializing() const {
    return main().tracker().IsInitializing() ||
           (growing_ && growing_->session().tracker().IsInitializing());
  }
  Session& main() { return *main_->session; }
  const Session& main() const { return *main_->session; }
  // The number of the main submap, in whose frame poses are reported.
  int main_number() const { return main_->number; }
  // The pose of the newest image in the submap that grows, and the number of that; nothing where
  // none grows, or the camera is not followed in it.
  std::optional<std::pair<int, ImagePose>> PoseInGrowing() const;
  // The submaps that were joined with the main one, directly or not, by number: main_from_submap,
  // as it was when they were joined, in the present unit.
  std::map<int, Similarity> Joined() const;
  // What a submap that was joined with the main one tells of the unit of that, once after the
  // joining: the main one is to be scaled to metres.
  std::optional<Metre> TakeMetre() { return std::exchange(metre_, std::nullopt); }
  // All submaps but the main one, by descending number of keyframes, numbered so that no two share
  // an id. Waits for the mapping of the growing one.
  std::vector<Submap> Others();

 private:
  // The submap that grows.
  struct Growth {
    AtlasSubmap* submap;
    std::optional<double> lost_since{}, found_since{};  // in it; in the main one: time stamps
    SubmapLink to_main{};
    ImagePose pose{};  // of the newest image
    Session& session() const { return *submap->session; }
  };

  // What the tracker of the main submap, or of the growing one, may do.
  MapUse use() const;
  TrackingContext MainContext();
  TrackingContext GrowingContext() {
    return {MapUse::kExtend, mode_, &growing_->submap->next_keyframe, &next_object_};
  }

  ImagePose ProcessGrowing(const Frame& frame, const TrackingStep& in_main);
  TrackingStep GoOnElsewhere(const Frame& frame);
  AtlasSubmap& Begin(Map map, bool has_map, uint32_t next_keyframe);
  void BeginGrowing();
  void EndGrowing();
  bool JoinGrowing();
  void LookFrom(const Frame& keyframe, AtlasSubmap& in);
  void LookFor(const Frame& keyframe, AtlasSubmap& in, AtlasSubmap& waiting);
  void GoBackTo(AtlasSubmap& waiting);
  bool JoinWaiting(const AtlasSubmap& waiting, const SubmapAlignment& world_from_waiting,
                   AtlasSubmap& into);
  bool JoinWaiting(const AtlasSubmap& waiting, AtlasSubmap& into);
  std::optional<SubmapAlignment> PlaceIn(const Map& world, const std::vector<FramePose>& trajectory,
                                         const AtlasSubmap& waiting,
                                         Relocalizer& relocalizer) const;
  void ScaleJoinings(int into, double factor);
  void JoinAll();
  void PromoteLargest();
  void Wake(AtlasSubmap& waiting);
  void Lead(AtlasSubmap& submap);
  void Rest(AtlasSubmap& submap);
  void Erase(const AtlasSubmap& submap);
  void End(std::unique_ptr<Session> session);
  std::vector<AtlasSubmap*> Waiting();
  bool MustStayMain() const;

  SlamConfig config_;
  RelocalizationMode mode_ = RelocalizationMode::kPointsAndObjects;
  bool mapping_ = true;
  bool is_loaded_;        // the main submap, by the user
  uint32_t next_object_;  // of the run
  // Those that wait in the order in which they began to.
  std::list<AtlasSubmap> submaps_;
  AtlasSubmap* main_ = nullptr;
  std::optional<Growth> growing_;
  size_t turn_ = 0;                   // selects the waiting submap in which to look next
  std::optional<double> lost_since_;  // time stamp, seconds; with mapping
  // Time stamp in seconds of the last frame that was looked for in the main submap and not found.
  std::optional<double> last_vain_look_;
  int next_number_ = 0;
  // Of a submap that was joined with another, by number.
  struct Joining {
    int into = 0;  // the number of the other one
    Similarity into_from_joined;
  };
  std::map<int, Joining> joinings_;
  std::optional<Metre> metre_;  // of the main submap, by one that was joined with it
  std::exception_ptr failure_;  // exception of a session that has ended
  std::jthread ending_;         // destroys a session; in live mode
};

}  // namespace oaslam
