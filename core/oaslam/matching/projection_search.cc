#include "oaslam/matching/projection_search.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/matching/orientation_check.h"
#include "oaslam/matching/two_nearest.h"

namespace oaslam {
namespace {

// 60 degrees: a patch is foreshortened to half there, and its descriptor no longer matches.
constexpr double kMinViewCos = 0.5;
// About 3.6 degrees: the level and the descriptor are as predicted, so that a narrow search
// suffices.
constexpr double kSameViewCos = 0.998;
// A landmark is predicted on a level of the pyramid with an error of one: a factor of 1.2 in
// distance.
constexpr double kNearer = 0.8, kFarther = 1.2;

bool Inside(const Box& bounds, const Eigen::Vector2d& px) {
  return px.x() >= bounds.x1 && px.x() <= bounds.x2 && px.y() >= bounds.y1 && px.y() <= bounds.y2;
}

// Assigns landmarks to key points: where two landmarks compete for a key point, the closer
// descriptor wins.
class Claims {
 public:
  explicit Claims(std::vector<LandmarkId> taken)
      : landmarks_(std::move(taken)), distance_(landmarks_.size(), -1) {}

  bool IsTaken(int keypoint) const {
    return landmarks_[keypoint].IsValid() && distance_[keypoint] < 0;
  }
  void Claim(int keypoint, LandmarkId landmark, int distance) {
    if (landmarks_[keypoint].IsValid() && distance_[keypoint] <= distance) return;
    landmarks_[keypoint] = landmark;
    distance_[keypoint] = distance;
  }
  void Release(int keypoint) { landmarks_[keypoint] = LandmarkId(); }
  LandmarkId operator[](int keypoint) const { return landmarks_[keypoint]; }

  LandmarkMatches Finish() && {
    const auto count =
        std::ranges::count_if(landmarks_, [](LandmarkId id) { return id.IsValid(); });
    return {std::move(landmarks_), static_cast<int>(count), std::move(distance_)};
  }

 private:
  std::vector<LandmarkId> landmarks_;
  std::vector<int> distance_;  // negative: matched beforehand, and kept
};

std::vector<Descriptor> LearnedViews(const Map& map, const Landmark& landmark) {
  std::vector<Descriptor> views;
  for (const Observation& o : landmark.observations)
    if (const Descriptor* view = map.keyframes.At(o.keyframe).features->learned.Find(o.keypoint))
      views.push_back(*view);
  return views;
}

int Nearest(const std::vector<Descriptor>& views, const Descriptor& descriptor) {
  int nearest = TwoNearest::kNone;
  for (const Descriptor& view : views)
    nearest = std::min(nearest, HammingDistance(view, descriptor));
  return nearest;
}

}  // namespace

std::optional<ProjectedLandmark> ProjectLandmark(LandmarkId id, const Landmark& landmark,
                                                 const Camera& camera, const Rigid3& cam_from_world,
                                                 const Features& features) {
  const Eigen::Vector3d x_in_cam = cam_from_world * landmark.position;
  if (x_in_cam.z() <= kMinDepth) return std::nullopt;
  const Eigen::Vector2d px = ProjectIdeal(camera, x_in_cam);
  if (!Inside(features.bounds, px)) return std::nullopt;
  const double distance = x_in_cam.norm(), appears_at = distance / features.pyramid.zoom;
  if (appears_at < kNearer * landmark.min_distance || appears_at > kFarther * landmark.max_distance)
    return std::nullopt;
  const double view_cos = x_in_cam.dot(cam_from_world.rotation * landmark.normal) / distance;
  if (view_cos < kMinViewCos) return std::nullopt;
  return ProjectedLandmark{id, px, features.pyramid.PredictLevel(distance, landmark.max_distance),
                           view_cos};
}

LandmarkMatches SearchByProjection(const Features& features, const Map& map,
                                   std::span<const ProjectedLandmark> projected,
                                   std::vector<LandmarkId> taken,
                                   const ProjectionSearchOptions& options) {
  Claims claims(std::move(taken));
  for (const ProjectedLandmark& p : projected) {
    const Landmark& landmark = map.landmarks.At(p.id);
    const std::vector<Descriptor> views =
        options.by_learned ? LearnedViews(map, landmark) : std::vector<Descriptor>();
    const double narrow = options.radius_by_view && p.view_cos > kSameViewCos ? 2.5 / 4 : 1;
    const double radius = options.radius_px * narrow * features.pyramid.scale[p.level];
    TwoNearest near;
    features.VisitNear(p.px, radius, [&](int k) {
      const int level = features.keypoints[k].octave;
      if (level < p.level - 1 || level > p.level + 1 || claims.IsTaken(k)) return;
      int distance = HammingDistance(landmark.descriptor, features.descriptors[k]);
      const Descriptor* learned = views.empty() ? nullptr : features.learned.Find(k);
      if (learned) distance = std::min(distance, Nearest(views, *learned));
      near.Add(distance, level, k);
    });
    if (near.best > options.max_hamming) continue;
    if (near.best_level == near.next_level && near.best > options.ratio * near.next) continue;
    claims.Claim(near.keypoint, p.id, near.best);
  }
  return std::move(claims).Finish();
}

LandmarkMatches SearchFromLastFrame(const Features& features, const Camera& camera,
                                    const Rigid3& cam_from_world, const Map& map,
                                    const Features& last_features,
                                    std::span<const LandmarkId> last_landmarks, double radius_px) {
  Claims claims(std::vector<LandmarkId>(features.keypoints.size()));
  std::vector<int> keypoint_of(last_landmarks.size(), -1);
  for (size_t i = 0; i < last_landmarks.size(); ++i) {
    const Landmark* landmark =
        last_landmarks[i].IsValid() ? map.landmarks.Find(last_landmarks[i]) : nullptr;
    if (!landmark) continue;
    const Eigen::Vector3d x_in_cam = cam_from_world * landmark->position;
    if (x_in_cam.z() <= kMinDepth) continue;
    const Eigen::Vector2d px = ProjectIdeal(camera, x_in_cam);
    if (!Inside(features.bounds, px)) continue;
    const int last_level = last_features.keypoints[i].octave;
    int best = kLooseHamming + 1;
    features.VisitNear(px, radius_px * features.pyramid.scale[last_level], [&](int k) {
      if (std::abs(features.keypoints[k].octave - last_level) > 1) return;
      const int distance = HammingDistance(landmark->descriptor, features.descriptors[k]);
      if (distance < best) {
        best = distance;
        keypoint_of[i] = k;
      }
    });
    if (keypoint_of[i] >= 0) claims.Claim(keypoint_of[i], last_landmarks[i], best);
  }
  std::vector<int> matched;
  std::vector<float> turns;
  for (size_t i = 0; i < last_landmarks.size(); ++i) {
    if (keypoint_of[i] < 0 || claims[keypoint_of[i]] != last_landmarks[i]) continue;
    matched.push_back(keypoint_of[i]);
    turns.push_back(last_features.keypoints[i].angle_rad -
                    features.keypoints[keypoint_of[i]].angle_rad);
  }
  const std::vector<char> consistent = ConsistentOrientations(turns);
  for (size_t m = 0; m < matched.size(); ++m)
    if (!consistent[m]) claims.Release(matched[m]);
  return std::move(claims).Finish();
}

}  // namespace oaslam
