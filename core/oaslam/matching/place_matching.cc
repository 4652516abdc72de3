#include "oaslam/matching/place_matching.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <set>
#include <span>

#include "oaslam/features/hamming_search.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/orientation_check.h"

namespace oaslam {
namespace {

// Loose bounds, since what is wrong among mutual matches is found by geometry: the largest
// distance, and the largest ratio of it to that of the nearest other point.
constexpr int kMaxMatchHamming = 80;
constexpr double kMatchRatio = 0.9;
constexpr int kNoRival = 90;  // so far away, the nearest other point refuses no match
// Points without a landmark that are closer together than this share of their depth are one point
// that several keyframes know.
constexpr double kSamePoint = 0.03;

struct PlacePoint {
  LandmarkId landmark;  // may be invalid
  Eigen::Vector3d position;
  double depth = 0;  // where there is no landmark
};

bool AreSame(const PlacePoint& a, const PlacePoint& b) {
  if (a.landmark.IsValid() && b.landmark.IsValid()) return a.landmark == b.landmark;
  return (a.position - b.position).norm() < kSamePoint * std::max(a.depth, b.depth);
}

// How the keyframes of a place show its points; a structure of arrays.
struct Views {
  std::vector<PlacePoint> points;
  std::vector<int> point;  // by view: index into `points`
  DescriptorColumns descriptor;
  std::vector<float> angle_rad;

  const PlacePoint& PointOf(int view) const { return points[point[view]]; }
  void Add(size_t of, const Descriptor& view, const Keypoint& keypoint) {
    point.push_back(static_cast<int>(of));
    descriptor.Add(view);
    angle_rad.push_back(keypoint.angle_rad);
  }
};

Views ViewsByOrb(const Map& map, const Place& place) {
  Views views;
  const std::vector<LandmarkId> landmarks = LandmarksSeenBy(map, place.keyframes);
  for (const LandmarkId id : landmarks) views.points.push_back({id, map.landmarks.At(id).position});
  for (const KeyframeId id : place.keyframes) {
    const Keyframe& keyframe = map.keyframes.At(id);
    for (size_t k = 0; k < keyframe.landmarks.size(); ++k) {
      if (!keyframe.landmarks[k].IsValid()) continue;
      const auto at = std::ranges::lower_bound(landmarks, keyframe.landmarks[k]);
      views.Add(at - landmarks.begin(), keyframe.features->descriptors[k],
                keyframe.features->keypoints[k]);
    }
  }
  return views;
}

Views ViewsByLearned(const Map& map, const Place& place) {
  Views views;
  for (const LandmarkId id : LandmarksSeenBy(map, place.keyframes)) {
    const Landmark& landmark = map.landmarks.At(id);
    for (const Observation& o : landmark.observations) {
      const Features& features = *map.keyframes.At(o.keyframe).features;
      if (const Descriptor* described = features.learned.Find(o.keypoint))
        views.Add(views.points.size(), *described, features.keypoints[o.keypoint]);
    }
    views.points.push_back({id, landmark.position});
  }
  for (const KeyframeId id : place.keyframes) {
    const Keyframe& keyframe = map.keyframes.At(id);
    const Camera& camera = map.cameras[static_cast<size_t>(keyframe.camera)];
    const LearnedDescriptors& learned = keyframe.features->learned;
    for (size_t i = 0; i < learned.keypoints.size(); ++i) {
      const double depth = keyframe.learned_depths[i];
      if (depth == 0 || keyframe.landmarks[learned.keypoints[i]].IsValid()) continue;
      const Keypoint& keypoint = keyframe.features->keypoints[learned.keypoints[i]];
      views.Add(views.points.size(), learned.descriptors[i], keypoint);
      views.points.push_back(
          {LandmarkId(),
           keyframe.cam_from_world.Inverse() * (depth * RayOf(camera, keypoint.px.cast<double>())),
           depth});
    }
  }
  return views;
}

struct NearestKeypoint {
  int distance = kMaxMatchHamming + 1;
  int keypoint = -1;
};

// Nearest points of a keypoint that are at least so far away refuse no match at the distance
// `best`.
uint8_t RivalsBelow(int best) {
  return static_cast<uint8_t>(std::min<double>(kNoRival, best / kMatchRatio + 1));
}

// `descriptors`: those of `keypoints`, which are some of those of the image.
std::vector<PlaceMatch> MatchViews(const Views& views, const Features& features,
                                   std::span<const Descriptor> descriptors,
                                   std::span<const int> keypoints) {
  std::vector<NearestKeypoint> seen_of(views.points.size());
  std::vector<int> view_of(descriptors.size(), -1);
  std::vector<uint8_t> nearest(views.point.size(), kMaxMatchHamming + 1);  // by view: distance
  std::array<DistanceRow, kComparedTogether> rows;
  std::vector<int> close;
  for (size_t s = 0; s < descriptors.size(); ++s) {
    const size_t together = s % kComparedTogether;
    if (together == 0)
      CompareWithAll(descriptors.subspan(s, std::min(kComparedTogether, descriptors.size() - s)),
                     views.descriptor, rows);
    const DistanceRow& row = rows[together];
    const int best = row.smallest;
    if (best > kMaxMatchHamming) continue;
    FindBelow(row, nearest, RivalsBelow(best), close);
    const int view = *std::ranges::find(close, best, [&](int v) { return row.hamming[v]; });
    int rival = kNoRival;  // distance of the nearest view of another point
    for (const int v : close) {
      const int distance = row.hamming[v];
      nearest[v] = std::min(nearest[v], row.hamming[v]);
      if (NearestKeypoint& near = seen_of[views.point[v]]; distance < near.distance)
        near = {distance, keypoints[s]};
      if (distance < rival && !AreSame(views.PointOf(v), views.PointOf(view))) rival = distance;
    }
    if (best < kMatchRatio * rival) view_of[s] = view;
  }
  std::vector<PlaceMatch> mutual;
  std::vector<float> turns;
  for (size_t s = 0; s < descriptors.size(); ++s) {
    const int view = view_of[s], keypoint = keypoints[s];
    if (view < 0 || seen_of[views.point[view]].keypoint != keypoint) continue;
    const PlacePoint& point = views.PointOf(view);
    mutual.push_back(
        {keypoint, point.landmark, point.position, seen_of[views.point[view]].distance});
    turns.push_back(views.angle_rad[view] - features.keypoints[keypoint].angle_rad);
  }
  const std::vector<char> consistent = ConsistentOrientations(turns);
  std::vector<PlaceMatch> kept;
  for (size_t i = 0; i < mutual.size(); ++i)
    if (consistent[i]) kept.push_back(mutual[i]);
  return kept;
}

std::vector<PlaceMatch> MatchByOrb(const Features& features, const Map& map, const Place& place) {
  std::vector<int> keypoints(features.keypoints.size());
  std::iota(keypoints.begin(), keypoints.end(), 0);
  return MatchViews(ViewsByOrb(map, place), features, features.descriptors, keypoints);
}

std::vector<PlaceMatch> MatchByLearned(const Features& features, const Map& map,
                                       const Place& place) {
  const LearnedDescriptors& learned = features.learned;
  const std::vector<int> keypoints(learned.keypoints.begin(), learned.keypoints.end());
  return MatchViews(ViewsByLearned(map, place), features, learned.descriptors, keypoints);
}

// Adds those of points and key points that have none yet.
void AddMissing(const std::vector<PlaceMatch>& more, std::vector<PlaceMatch>& matches) {
  std::set<int> keypoints;
  std::set<LandmarkId> landmarks;
  for (const PlaceMatch& m : matches) {
    keypoints.insert(m.keypoint);
    landmarks.insert(m.landmark);
  }
  for (const PlaceMatch& m : more)
    if (!keypoints.contains(m.keypoint) && !landmarks.contains(m.landmark)) matches.push_back(m);
}

}  // namespace

std::vector<PlaceMatch> MatchPlace(const Features& features, const Map& map, const Place& place,
                                   Appearance appearance) {
  std::vector<PlaceMatch> matches;
  if (appearance == Appearance::kLearned) matches = MatchByLearned(features, map, place);
  AddMissing(MatchByOrb(features, map, place), matches);
  std::ranges::stable_sort(matches, {}, &PlaceMatch::distance);
  return matches;
}

}  // namespace oaslam
