#pragma once

#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// At most so many triplets of an image are tried. All of them are where a map has some ten objects;
// their number grows with the cube of the boxes and of the objects of each class.
constexpr int kMaxPaperTriplets = 10000;

// Poses of a camera from its detected objects alone, in the map's frame, as the paper has them
// (OA-SLAM, Zins et al., ISMAR 2022, section "Relocalization using Objects"): the baseline that
// RelocalizeByObjects is compared with. Each triplet of detections, with each choice of objects of
// their classes, gives up to four poses by P3P on the centres of boxes and ellipsoids, of which the
// one with the largest overlap counts. `score` is that overlap: the sum, over detections, of the
// IoU of the box with that of the projected ellipsoid that it is associated with.
//
// Up to five distinct poses, best first. The first is accepted however little overlaps. Empty with
// fewer than three detections whose classes are in the map, or where nothing overlaps. `rng` draws
// kMaxPaperTriplets triplets where there are more.
std::vector<ObjectPoseCandidate> RelocalizeByObjectsAsInPaper(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, Rng& rng);

}  // namespace oaslam
