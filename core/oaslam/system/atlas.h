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
// was made. Either the camera is tracked in it, or it waits until its transformation to another
// submap is known.
struct AtlasSubmap {
  int number = 0;                    // unique in a run
  std::unique_ptr<Session> session;  // null: the submap waits
  uint32_t next_keyframe = 0;        // the id of the next new one; only with a session
  // The next three members are of a waiting submap only.
  Submap content{};
  Relocalizer relocalizer;  // with an index of its places
  SubmapLink link{};        // poses in this submap of frames that are tracked in another
  // Time stamp of the last image whose pose the submap gave; minus infinity for a submap of an
  // earlier run.
  double seen_at = -INFINITY;

  bool IsWaiting() const { return !session; }
  // Of a waiting submap only.
  size_t keyframes() const { return content.map.keyframes.size(); }
};

// All submaps of a run. Poses are reported in the frame of the main submap. While the camera is
// lost in the main submap, it is tracked in a second one, which grows. All other submaps wait. Two
// submaps are joined as soon as enough frames have a pose in both, by points or objects. No submap
// is dropped. Without mapping, no submap grows.
// - A submap begins to grow once the camera has been lost for a while. The camera is still searched
//   in the main submap.
// - While the camera is found in the main submap by objects only, it is tracked in both submaps
//   until the transformation between them is known (paper, section "Application to AR": resuming
//   SLAM).
// - Once the camera is found in the main submap by points, it is tracked in both submaps for half a
//   second more. After that time, or where the camera is lost in the growing submap, too, the
//   growing submap waits.
// - The growing submap becomes the main one when it is larger than the main one while the camera is
//   lost there, or when the main one is given up, being too small to find the camera again.
// - Where a waiting submap is found to contain the place of the growing one while the camera is
//   lost in the main one, the waiting submap becomes the main one, and the growing submap is joined
//   with it.
// - A main submap that was loaded, has anchors or is in metres stays the main one.
class Atlas {
 public:
  // `is_loaded`: the camera is looked for in `map`, which stays the main submap unless it is empty,
  // and no initial map is made.
  Atlas(const SlamConfig& config, Map map, bool is_loaded, std::vector<Submap> others);

  // Whether the next frame must have features; without features its pose is by dead reckoning.
  // `motion`: null as long as it is not known.
  bool NeedsFeatures(double timestamp, const FrameMotion* motion) const;
  // Tracks the next frame.
  TrackingStep Process(const Frame& frame);
  // Detections of a frame that was processed before.
  std::optional<TrackingStep> AddDetections(int frame_index,
                                            const std::vector<ObjectDetection>& detections);
  // Joins the submaps that can be joined, makes the largest one the main one unless that must keep
  // its place, and waits for the last optimisation. Without mapping the map does not change.
  void Finish();
  // The exception that ended the mapping of any submap (MapPipeline); null while mapping works.
  // After a failure the caller gives no more frames. All submaps are kept. Where the mapping of the
  // main submap still works, Finish joins the growing submap with it if it can, and optimises the
  // main submap; Finish leaves waiting submaps as they are.
  std::exception_ptr failure();

  void SetRelocalizationMode(RelocalizationMode mode) { mode_ = mode; }
  void SetMapping(bool enabled);
  void ForceRelocalization(const std::optional<Rigid3>& near);
  // Scales the main submap to metres. `by_objects`: as for Session::ScaleToMetres.
  void SetMetresPerUnit(double metres, const std::optional<UnitEvidence>& by_objects = {});
  void SetClassRelations(const ClassRelations& relations);

  bool IsInitializing() const {
    return main().tracker().IsInitializing() ||
           (growing_ && growing_->session().tracker().IsInitializing());
  }
  Session& main() { return *main_->session; }
  const Session& main() const { return *main_->session; }
  // The number of the main submap, in whose frame poses are reported.
  int main_number() const { return main_->number; }
  // The number of the growing submap, and the pose of the newest image in it; nothing where no
  // submap grows, or where the camera is not followed in the growing one.
  std::optional<std::pair<int, ImagePose>> PoseInGrowing() const;
  // main_from_submap of each submap that was joined with the main one, directly or through others,
  // by number: the transformation at the joining, in the present unit.
  std::map<int, Similarity> Joined() const;
  // Removes and returns the length of the main submap's unit in metres, where a submap in metres
  // has been joined with the main one: the caller is to scale the main submap by it.
  std::optional<Metre> TakeMetre() { return std::exchange(metre_, std::nullopt); }
  // All submaps but the main one, by descending number of keyframes, numbered so that no two share
  // an id. Waits for the mapping of the growing one.
  std::vector<Submap> Others();

 private:
  struct Growth {
    AtlasSubmap* submap;
    std::optional<double> lost_since{}, found_since{};  // time stamps: here; in the main one
    SubmapLink to_main{};
    std::optional<Metre> metre{};  // of its unit, by a submap that was joined with it
    ImagePose pose{};              // of the newest image
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
  // Waiting submaps come in the order in which they began to wait.
  std::list<AtlasSubmap> submaps_;
  AtlasSubmap* main_ = nullptr;
  std::optional<Growth> growing_;
  size_t turn_ = 0;                   // selects the waiting submap in which to look next
  std::optional<double> lost_since_;  // time stamp, seconds; with mapping
  // Time stamp in seconds of the last frame that was looked for in the main submap and not found.
  std::optional<double> last_vain_look_;
  int next_number_ = 0;
  // The submap with which another one was joined, and the transformation; `joinings_` is by the
  // number of the joined submap.
  struct Joining {
    int into = 0;  // number of the submap that it was joined with
    Similarity into_from_joined;
  };
  std::map<int, Joining> joinings_;
  std::optional<Metre> metre_;  // of the main submap, by one that was joined with it
  std::exception_ptr failure_;  // exception of a session that has ended
  std::jthread ending_;         // destroys a session; in live mode
};

}  // namespace oaslam
