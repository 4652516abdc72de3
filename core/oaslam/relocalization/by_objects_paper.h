#pragma once

#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The largest number of triplets that are tried for an image, which bounds the time: their number
// grows with the cube of the number of boxes, and of objects of each class. Maps of about ten
// objects have fewer.
constexpr int kMaxPaperTriplets = 10000;

// Finds the camera by its detected objects alone, as the paper describes it (OA-SLAM, Zins et al.,
// ISMAR 2022, section "Relocalization using Objects"): the baseline with which RelocalizeByObjects
// is compared. Each triplet of detections, with each choice of objects of their classes, gives up
// to four poses by P3P on the centres of boxes and ellipsoids; the one with the largest overlap is
// kept. `score` is that overlap: the sum, over detections, of the IoU of the box with the box of
// the projected ellipsoid assigned to it.
//
// Up to five distinct poses, best first. The first is always accepted, however small its overlap.
// Empty if fewer than three detections have a class of the map, or nothing overlaps. `rng` draws
// kMaxPaperTriplets triplets where there are more.
std::vector<Relocalization> RelocalizeByObjectsAsInPaper(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, Rng& rng);

}  // namespace oaslam
