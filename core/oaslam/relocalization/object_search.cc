#include "oaslam/relocalization/object_search.h"

#include <algorithm>
#include <numbers>

#include "oaslam/relocalization/object_hypotheses.h"
#include "oaslam/relocalization/object_refinement.h"

namespace oaslam {
namespace {

// Best guesses that are refined, which takes most of the time of a search.
constexpr size_t kRefined = 12;
constexpr size_t kFewGuesses = 5;  // so few guesses may all be wrong
// Poses that differ by more than this are distinct: 15 cm at 1.5 m, or 8 degrees.
constexpr double kElsewherePerDepth = 0.1, kElsewhereAngle = 8 * std::numbers::pi / 180;
// Where the vertical is measured, wrong poses have less freedom, and this share of the evidence
// suffices, with one object less (tools/acceptance --scan).
constexpr double kGravityShare = 15.0 / 17;  // of relocalization.accept_evidence

void Refine(const ObjectScene& scene, const std::vector<PoseHypothesis>& guesses,
            std::vector<Relocalization>& refined) {
  for (const PoseHypothesis& guess : SelectDistinct(guesses, kRefined))
    refined.push_back(RefineObjectPose(scene, guess));
  std::ranges::stable_sort(refined, std::ranges::greater{},
                           [](const Relocalization& r) { return r.objects.score; });
}

}  // namespace

bool AreElsewhere(const Relocalization& a, const Relocalization& b) {
  return AreDifferent(a.cam_from_world, b.cam_from_world, kElsewherePerDepth * a.objects.depth,
                      kElsewhereAngle);
}

ObjectDemands::ObjectDemands(const ObjectScene& scene, const RelocalizationConfig& config)
    : margin(config.accept_margin),
      evidence(config.accept_evidence * (scene.up_in_cam ? kGravityShare : 1)),
      objects(config.accept_objects - (scene.up_in_cam ? 1 : 0)),
      confidence(config.accept_confidence) {}

void ObjectDemands::Judge(int matched, Relocalization& best) const {
  ObjectSupport& support = best.objects;
  support.suffices = !support.matched.empty() && support.margin > margin &&
                     support.Evidence() > evidence && matched >= objects;
  best.evidence = support.suffices && best.confidence >= confidence ? PoseEvidence::kObjects
                                                                    : PoseEvidence::kNone;
  if (!best.IsFound()) best.why_not = "the objects' evidence is too weak";
}

std::vector<Relocalization> SearchPoses(const ObjectScene& scene, const ObjectDemands& demands,
                                        Rng& rng) {
  std::vector<Relocalization> refined;
  const std::vector<PoseHypothesis> guesses = GuessFromGroups(scene, rng);
  Refine(scene, guesses, refined);
  // Guesses from single objects find poses that groups do not, but they are many and mostly wrong.
  // They are omitted if a guess from a group already has a score that will be accepted, unless a
  // pose elsewhere has half that score.
  if (guesses.size() < kFewGuesses || refined.empty() ||
      refined.front().objects.score < demands.evidence)
    Refine(scene, GuessFromSingles(scene), refined);
  return refined;
}

}  // namespace oaslam
