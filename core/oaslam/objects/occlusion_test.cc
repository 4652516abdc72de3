#include "oaslam/objects/occlusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/objects/known_poses.h"
#include "object_table.h"

namespace oaslam {
namespace {

using namespace object_table;

// A wide object stands in front of a long one, so that the detector sees only the part of the long
// one beside it.
std::vector<PosedDetections> FilmWithOcclusion(const TrueObject& front, const TrueObject& behind,
                                               bool cut) {
  std::vector<PosedDetections> film =
      Film({front}, 160, {.box_px = 1, .miss_rate = 0, .false_rate = 0}, 3);
  for (PosedDetections& frame : film) {
    const Box hiding = *ProjectToBox(front.ellipsoid, frame.cam_from_world, kCamera);
    Box box = *ProjectToBox(behind.ellipsoid, frame.cam_from_world, kCamera);
    const bool is_nearer = (frame.cam_from_world * front.ellipsoid.center).z() <
                           (frame.cam_from_world * behind.ellipsoid.center).z();
    if (cut && is_nearer && hiding.x1 < box.x2 && hiding.x2 > box.x2) box.x2 = hiding.x1;
    if (cut && is_nearer && hiding.x2 > box.x1 && hiding.x1 < box.x1) box.x1 = hiding.x2;
    if (box.Width() > 8) frame.detections.push_back({behind.category_id, 0.8, box, 0});
  }
  return film;
}

TEST(Occlusion, WhatAnotherObjectHidesDoesNotPullAtTheModel) {
  const TrueObject front{75, {{0.45, 0.2, 0.15}, {0.1, 0.1, 0.2}, Eigen::Quaterniond::Identity()}};
  const TrueObject behind{66,
                          {{-0.05, 0.25, 0.05}, {0.2, 0.2, 0.06}, Eigen::Quaterniond::Identity()}};
  const auto error_of = [&](ObjectMethod model, bool cut) {
    ObjectsConfig config;
    config.model = model;
    config.min_accept_share = 0.5;
    const KnownPoseMap result =
        MapObjectsFromKnownPoses(FilmWithOcclusion(front, behind, cut), kCamera, config);
    double error = 1;
    for (const Object& object : MappedObjects(result.map))
      if (object.category_id == behind.category_id)
        error = std::min(error, (object.ellipsoid.center - behind.ellipsoid.center).norm());
    return error;
  };
  EXPECT_LT(error_of(ObjectMethod::kRobust, false), 0.01);
  EXPECT_LT(error_of(ObjectMethod::kRobust, true), 0.015);
  EXPECT_GT(error_of(ObjectMethod::kPaper, true),
            0.025);  // the paper's model treats cut boxes as complete
}

}  // namespace
}  // namespace oaslam
