#include "oaslam/relocalization/by_objects.h"

#include <Eigen/LU>
#include <algorithm>
#include <numbers>

#include "oaslam/relocalization/object_hypotheses.h"
#include "oaslam/relocalization/object_refinement.h"

namespace oaslam {
namespace {

constexpr size_t kRefined = 12;  // the number of best guesses that are refined
constexpr size_t kReturned = 5;
constexpr size_t kFewGuesses = 5;
// Poses that differ by more than this are distinct, for the margin and the list: 15 cm at 1.5 m, or
// 8 degrees.
constexpr double kElsewherePerDepth = 0.1, kElsewhereAngle = 8 * std::numbers::pi / 180;
// Where the vertical is measured, wrong poses have less freedom, and this share of the evidence
// suffices, with one object less (tools/acceptance --scan).
constexpr double kGravityShare = 15.0 / 17;  // of relocalization.accept_evidence

struct Refined {
  ObjectPoseCandidate candidate;
  double depth = 0;
};

void Refine(const ObjectScene& scene, const std::vector<PoseGuess>& guesses,
            std::vector<Refined>& refined) {
  for (const PoseGuess& guess : SelectDistinct(guesses, kRefined))
    refined.push_back({RefineObjectPose(scene, guess.cam_from_world), guess.depth});
  std::ranges::stable_sort(refined, [](const Refined& a, const Refined& b) {
    return a.candidate.score > b.candidate.score;
  });
}

bool AreElsewhere(const Refined& a, const Refined& b) {
  return AreDifferent(a.candidate.cam_from_world, b.candidate.cam_from_world,
                      kElsewherePerDepth * a.depth, kElsewhereAngle);
}

// Selects distinct poses from `refined`, which is sorted best first, and computes their margins.
std::vector<ObjectPoseCandidate> DistinctCandidates(std::vector<Refined>& refined) {
  std::vector<Refined> distinct;
  for (const Refined& r : refined) {
    const bool is_new =
        std::ranges::all_of(distinct, [&](const Refined& d) { return AreElsewhere(d, r); });
    if (is_new && distinct.size() < kReturned) distinct.push_back(r);
  }
  std::vector<ObjectPoseCandidate> candidates;
  for (const Refined& d : distinct) {
    candidates.push_back(d.candidate);
    const auto rival =
        std::ranges::find_if(refined, [&](const Refined& r) { return AreElsewhere(d, r); });
    candidates.back().margin =
        d.candidate.score - (rival == refined.end() ? 0 : std::max(rival->candidate.score, 0.0));
  }
  return candidates;
}

}  // namespace

std::vector<ObjectPoseCandidate> RelocalizeByObjects(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng) {
  const ObjectScene scene(detections, camera, map, config, gravity_in_cam);
  if (scene.detections.empty()) return {};
  const double enough_evidence = config.accept_evidence * (scene.up_in_cam ? kGravityShare : 1);
  const int enough_objects = config.accept_objects - (scene.up_in_cam ? 1 : 0);

  std::vector<Refined> refined;
  const std::vector<PoseGuess> guesses = GuessFromGroups(scene, rng);
  Refine(scene, guesses, refined);
  // Guesses from single objects find poses that groups do not, but they are many and mostly wrong.
  // They are omitted if a guess from a group already has a score that will be accepted, unless a
  // pose elsewhere has half that score.
  if (guesses.size() < kFewGuesses || refined.empty() ||
      refined.front().candidate.score < enough_evidence)
    Refine(scene, GuessFromSingles(scene), refined);

  std::vector<ObjectPoseCandidate> candidates = DistinctCandidates(refined);
  if (!candidates.empty()) {
    ObjectPoseCandidate& best = candidates.front();
    best.accepted = best.margin > config.accept_margin && best.Evidence() > enough_evidence &&
                    static_cast<int>(best.matched.size()) >= enough_objects;
  }
  return candidates;
}

ObjectPoseCandidate RefineByPointsAndObjects(std::span<const ObjectDetection> detections,
                                             const Camera& camera, const Map& map,
                                             const RelocalizationConfig& config,
                                             const RelocalizationReport& by_points) {
  const ObjectScene scene(detections, camera, map, config, std::nullopt);
  const PosePrior prior{by_points.cam_from_world,
                        (by_points.covariance * by_points.inliers).inverse()};
  return RefineObjectPose(scene, by_points.cam_from_world, prior);
}

}  // namespace oaslam
