#include "oaslam/matching/descriptor_match.h"

#include <cmath>

#include "oaslam/features/band_search.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/skew.h"
#include "oaslam/matching/orientation_check.h"
#include "oaslam/matching/two_nearest.h"

namespace oaslam {
namespace {

// Drops pairs whose second key point has a closer match, and pairs whose change of orientation
// differs from that of most.
KeypointPairs Filter(const KeypointPairs& pairs, const std::vector<int>& distances,
                     const Features& first, const Features& second) {
  std::vector<int> winner(second.keypoints.size(), -1);
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    int& w = winner[pairs[i].second];
    if (w < 0 || distances[i] < distances[w]) w = i;
  }
  KeypointPairs unique;
  std::vector<float> turns;
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    if (winner[pairs[i].second] != i) continue;
    unique.push_back(pairs[i]);
    turns.push_back(first.keypoints[pairs[i].first].angle_rad -
                    second.keypoints[pairs[i].second].angle_rad);
  }
  const std::vector<char> consistent = ConsistentOrientations(turns);
  KeypointPairs kept;
  for (size_t i = 0; i < unique.size(); ++i)
    if (consistent[i]) kept.push_back(unique[i]);
  return kept;
}

Eigen::Matrix3d Calibration(const Camera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return k;
}

}  // namespace

KeypointPairs MatchWithinWindow(const Features& first, const Features& second,
                                std::span<const Eigen::Vector2d> expected, double window_px,
                                double ratio) {
  KeypointPairs pairs;
  std::vector<int> distances;
  for (int i = 0; i < first.size(); ++i) {
    const int level = first.keypoints[i].octave;
    TwoNearest near;
    second.VisitNear(expected[i], window_px, [&](int k) {
      const int other_level = second.keypoints[k].octave;
      if (std::abs(other_level - level) > 1) return;
      near.Add(HammingDistance(first.descriptors[i], second.descriptors[k]), other_level, k);
    });
    // A second-best match on another level is mostly the same corner.
    if (near.best > kTightHamming ||
        (near.best_level == near.next_level && near.best >= ratio * near.next))
      continue;
    pairs.emplace_back(i, near.keypoint);
    distances.push_back(near.best);
  }
  return Filter(pairs, distances, first, second);
}

KeypointPairs MatchAlongEpipolarLines(const Map& map, const Keyframe& first,
                                      const Keyframe& second) {
  const Camera& first_camera = map.cameras[first.camera];
  const Camera& second_camera = map.cameras[second.camera];
  const Rigid3 second_from_first = second.cam_from_world * first.cam_from_world.Inverse();
  // x2^T F x1 = 0 (Hartley & Zisserman, section 9.6)
  const Eigen::Matrix3d fundamental =
      Calibration(second_camera).inverse().transpose() * Skew(second_from_first.translation) *
      second_from_first.rotation.toRotationMatrix() * Calibration(first_camera).inverse();
  const Eigen::Vector3d epipole_ray = second_from_first.translation;
  const bool epipole_in_front = epipole_ray.z() > 1e-9;
  const Eigen::Vector2d epipole =
      epipole_in_front ? ProjectIdeal(second_camera, epipole_ray) : Eigen::Vector2d::Zero();

  const Features& a = *first.features;
  const Features& b = *second.features;
  // kChi2OneDof (3.841) to two digits: a wider band by 0.01 % could make other matches, and other
  // maps.
  constexpr double kEpipolarChi2 = 3.84;
  std::vector<int> free_second;
  BandPoints place;
  for (int k = 0; k < b.size(); ++k) {
    if (second.landmarks[k].IsValid()) continue;
    const Keypoint& keypoint = b.keypoints[k];
    const float sigma = b.pyramid.scale[keypoint.octave];
    // Within ten pixels of the epipole the depth cannot be determined.
    if (epipole_in_front && (keypoint.px.cast<double>() - epipole).squaredNorm() <
                                100 * sigma * b.pyramid.working_pixel())
      continue;
    free_second.push_back(k);
    place.Add(keypoint.px, static_cast<float>(std::sqrt(kEpipolarChi2)) * sigma);
  }
  KeypointPairs pairs;
  std::vector<int> distances;
  std::vector<int32_t> near;
  for (int i = 0; i < a.size(); ++i) {
    if (first.landmarks[i].IsValid()) continue;
    const Eigen::Vector3d line = fundamental * a.keypoints[i].px.cast<double>().homogeneous();
    const double norm = line.head<2>().norm();
    if (norm < 1e-12) continue;
    int best = kTightHamming + 1, best_keypoint = -1;
    const Eigen::Vector3f unit_line = (line / norm).cast<float>();
    for (const int32_t j : PointsNearLine(place, unit_line, near)) {
      const int distance = HammingDistance(a.descriptors[i], b.descriptors[free_second[j]]);
      if (distance < best) {
        best = distance;
        best_keypoint = free_second[j];
      }
    }
    if (best_keypoint < 0) continue;
    pairs.emplace_back(i, best_keypoint);
    distances.push_back(best);
  }
  return Filter(pairs, distances, a, b);
}

}  // namespace oaslam
