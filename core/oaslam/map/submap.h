#pragma once

#include <optional>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// A map with a frame and a unit of its own, and the poses of the frames from which it was made. In
// a map file no two submaps share an id.
struct Submap {
  Map map;
  std::vector<FramePose> trajectory;  // ascending by frame
};

// Adds the poses of a submap, scaled by `scale`, to those of another submap that it was
// joined with. Where both have a pose of a frame, the own one is kept, unless it is by
// objects and the other by points.
void AdoptPoses(const std::vector<FramePose>& other, double scale, std::vector<FramePose>& own);

// Scales a map, and the poses made with it, to metres; one unit was `metres_per_unit` metres long.
// `by_objects`: the evidence for that; nothing where the user gave it.
void ScaleToMetres(double metres_per_unit, const std::optional<UnitEvidence>& by_objects, Map& map,
                   std::vector<FramePose>& trajectory);

// Multiplies the lengths of poses that were made when all keyframes had the unit 1 by the present
// units of their keyframes (Keyframe::unit).
void FollowUnits(const Map& map, std::vector<FramePose>& poses);

// A keyframe converted back to a frame, with the boxes in it that observations of objects keep.
Frame FrameOf(const Map& map, KeyframeId id);

}  // namespace oaslam
