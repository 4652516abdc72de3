#include "oaslam/matching/place_search.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "oaslam/matching/place_matching.h"
#include "place_world.h"

namespace oaslam {
namespace {

using synthetic::DescribedWorld;
using synthetic::MakeFrame;
using synthetic::PlaceWorld;
using synthetic::PoseOnArc;
using synthetic::View;

constexpr PlaceSearchOptions kOptions{900, 0.9};

TEST(MatchPlace, FindsMostLandmarksOfAPlaceAndEachOnce) {
  const PlaceWorld f;
  Rng rng(3);
  const View view =
      MakeView(f.world, PoseOnArc({}, 5), {.flipped_bits = 30, .missed = 0.3, .clutter = 300}, rng);
  const std::vector<Place> places =
      f.index.RankPlaces(f.mapped.map, f.index.Find(*view.features), 1);
  ASSERT_EQ(places.size(), 1);
  const std::vector<PlaceMatch> matches = MatchPlace(*view.features, f.mapped.map, places[0]);
  int right = 0;
  std::set<LandmarkId> landmarks;
  for (const PlaceMatch& m : matches) {
    const int point = view.point_of_keypoint[m.keypoint];
    right += point >= 0 && f.mapped.landmark_of_point[point] == m.landmark;
    EXPECT_TRUE(landmarks.insert(m.landmark).second);
  }
  EXPECT_GT(right, 200);
  EXPECT_GT(right, 0.9 * static_cast<double>(matches.size()));
  EXPECT_TRUE(std::ranges::is_sorted(matches, {}, &PlaceMatch::distance));
}

TEST(MatchPlace, MatchesPointsThatTheirKeyframesAloneKnow) {
  DescribedWorld f(false);
  const Rigid3 truth = PoseOnArc({}, 7);
  const View view = MakeView(f.world, truth, {.flipped_bits = 20}, f.rng);
  const std::shared_ptr<const Features> features = synthetic::KnownByLearned(*view.features, f.rng);
  const Place place =
      f.index.RankPlaces(f.mapped.map, f.index.Find(*features, Appearance::kLearned), 1).at(0);
  const auto matches = MatchPlace(*features, f.mapped.map, place, Appearance::kLearned);
  int without_landmark = 0, right = 0;
  for (const PlaceMatch& m : matches) {
    without_landmark += !m.landmark.IsValid();
    const int point = view.point_of_keypoint[m.keypoint];
    right += point >= 0 && (f.world.points[point] - m.position).norm() < 0.1;
  }
  EXPECT_GT(without_landmark, static_cast<int>(matches.size()) / 4);
  EXPECT_LT(without_landmark, 3 * static_cast<int>(matches.size()) / 4);
  EXPECT_GT(right, 0.9 * static_cast<double>(matches.size()));
}

TEST(MatchPlace, OrbAddsWhatLearnedDescriptorsDoNotMatch) {
  // The map knows one half of its points by ORB, the other by learned descriptors.
  DescribedWorld f(true);
  std::set<LandmarkId> known_by_orb;
  for (const LandmarkId id : f.mapped.map.landmarks.Ids())
    if (f.rng.Index(2)) known_by_orb.insert(id);
  for (const KeyframeId id : f.mapped.map.keyframes.Ids()) {
    Keyframe& keyframe = f.mapped.map.keyframes.MutableAt(id);
    const LearnedDescriptors all = keyframe.features->learned;
    const std::vector<float> depths = std::exchange(keyframe.learned_depths, {});
    Features features = *keyframe.features;
    features.learned = {};
    for (uint16_t k = 0; k < features.size(); ++k) {
      if (known_by_orb.contains(keyframe.landmarks[k])) {
        features.descriptors[k] = all.descriptors[k];
        continue;
      }
      features.learned.keypoints.push_back(k);
      features.learned.descriptors.push_back(all.descriptors[k]);
      keyframe.learned_depths.push_back(depths[k]);
    }
    keyframe.features = std::make_shared<Features>(std::move(features));
  }
  ASSERT_TRUE(f.mapped.map.CheckInvariants().empty());
  const View view = MakeView(f.world, PoseOnArc({}, 7), {.flipped_bits = 20}, f.rng);
  Features seen = *synthetic::KnownByLearned(*view.features, f.rng);
  const Place place =
      PlaceAround(f.mapped.map, f.mapped.map.NearestKeyframe(PoseOnArc({}, 7).OriginInSource()));
  const auto count = [&](Appearance by) {
    return MatchPlace(seen, f.mapped.map, place, by).size();
  };
  const size_t by_learned_alone = count(Appearance::kLearned);
  seen.descriptors = view.features->descriptors;
  EXPECT_GT(count(Appearance::kLearned), 1.5 * static_cast<double>(by_learned_alone));
  EXPECT_GT(count(Appearance::kLearned), count(Appearance::kOrb));
  int right = 0;
  std::set<int> keypoints;
  std::set<LandmarkId> landmarks;
  for (const PlaceMatch& m : MatchPlace(seen, f.mapped.map, place, Appearance::kLearned)) {
    EXPECT_TRUE(keypoints.insert(m.keypoint).second);
    EXPECT_TRUE(landmarks.insert(m.landmark).second);
    const int point = view.point_of_keypoint[m.keypoint];
    right += point >= 0 && f.mapped.landmark_of_point[point] == m.landmark;
  }
  EXPECT_GT(right, 0.9 * static_cast<double>(keypoints.size()));
}

TEST(FindAtPlace, FindsAViewOfThePlaceAndJudgesIt) {
  const PlaceWorld f;
  Rng rng(3);
  const Rigid3 truth = PoseOnArc({}, 5);
  const Frame frame = MakeFrame(MakeView(f.world, truth, {.missed = 0.3}, rng));
  const Place place =
      PlaceAround(f.mapped.map, f.mapped.map.NearestKeyframe(truth.OriginInSource()));
  for (const double min_confidence : {0.9, 1.0}) {
    const auto found =
        FindAtPlace(frame, f.mapped.map, place, Appearance::kOrb, {900, min_confidence}, rng);
    ASSERT_TRUE(found);
    EXPECT_LT(CenterDistance(found->cam_from_world, truth), 0.02);
    EXPECT_GT(found->confidence, 0.99);
    EXPECT_EQ(found->IsFound(), min_confidence < 1) << found->confidence;
    EXPECT_EQ(found->why_not.empty(), found->IsFound());
  }
}

TEST(PlaceAround, BeginsWithTheKeyframe) {
  const PlaceWorld f;
  const Place place = PlaceAround(f.mapped.map, KeyframeId(3));
  EXPECT_EQ(place.keyframes.front(), KeyframeId(3));
  EXPECT_EQ(std::set(place.keyframes.begin(), place.keyframes.end()).size(), 6U);
}

TEST(FindNear, ConfirmsARoughPose) {
  const PlaceWorld f;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    const Rigid3 truth = PoseOnArc({}, 5);
    const View view = MakeView(f.world, truth, {.flipped_bits = 25, .clutter = 300}, rng);
    const Rigid3 guess = synthetic::Disturb(truth, 0.08, 0.03, rng);
    const Relocalization report = FindNear(MakeFrame(view), f.mapped.map,
                                           f.mapped.map.landmarks.Ids(), guess, 60, kOptions, rng);
    ASSERT_TRUE(report.IsFound()) << seed << ": " << report.why_not;
    EXPECT_LT(CenterDistance(report.cam_from_world, truth), 0.02);
  }
}

TEST(FindNear, RefusesAPoseThatIsElsewhere) {
  const PlaceWorld f;
  Rng rng(4);
  const View view = MakeView(f.world, PoseOnArc({}, 25), {}, rng);
  const Relocalization report =
      FindNear(MakeFrame(view), f.mapped.map, f.mapped.map.landmarks.Ids(), PoseOnArc({}, -90), 40,
               kOptions, rng);
  EXPECT_FALSE(report.IsFound());
}

TEST(FindNear, UsesTheGivenLandmarksAlone) {
  const PlaceWorld f;
  Rng rng(5);
  const Rigid3 truth = PoseOnArc({}, 5);
  const View view = MakeView(f.world, truth, {}, rng);
  std::vector<LandmarkId> half;
  for (const LandmarkId id : f.mapped.map.landmarks.Ids())
    if (id.value % 2 == 0) half.push_back(id);
  const Relocalization found =
      FindNear(MakeFrame(view), f.mapped.map, half, truth, 30, kOptions, rng);
  ASSERT_TRUE(found.IsFound()) << found.why_not;
  for (const LandmarkId id : found.points.landmarks)
    EXPECT_TRUE(!id.IsValid() || id.value % 2 == 0);
}

double OfPoints(int inliers, int expected, double covered, double relative_sigma) {
  PointSupport best;
  best.inliers = inliers;
  best.expected = expected;
  best.covered = covered;
  best.relative_sigma = relative_sigma;
  return ConfidenceOfPoints(best);
}

TEST(Confidence, OfPointsIsByWhatShouldBeInView) {
  EXPECT_GT(OfPoints(150, 500, 0.8, 0.03), 0.99);
  EXPECT_LT(OfPoints(150, 1500, 0.4, 0.03), OfPoints(150, 500, 0.8, 0.03));
  EXPECT_LT(OfPoints(100, 1200, 0.3, 0.08), 0.5);
  EXPECT_LT(OfPoints(150, 500, 0.8, 0.3), OfPoints(150, 500, 0.8, 0.03));
}

TEST(Confidence, OfAPosterIsLowWhateverItsSize) {
  PointSupport poster;
  poster.inliers = 176;
  poster.expected = 1150;
  poster.covered = 0.56;
  poster.relative_sigma = 0.082;
  EXPECT_GT(ConfidenceOfPoints(poster), 0.95);
  poster.is_of_one_plane = true;
  EXPECT_LT(ConfidenceOfPoints(poster), 0.9);
}

TEST(Confidence, OfFewPointsIsLowWhateverTheirShare) {
  EXPECT_EQ(OfPoints(7, 10, 1, 0.01), 0);
  EXPECT_LT(OfPoints(15, 15, 1, 0.01), 0.9);
}

}  // namespace
}  // namespace oaslam
