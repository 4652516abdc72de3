#include "oaslam/objects/presence.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "matchers.h"
#include "oaslam/objects/association.h"
#include "oaslam/objects/known_poses.h"
#include "oaslam/util/log.h"
#include "object_film.h"

namespace oaslam {
namespace {

using synthetic::OnCircle;
using testing::Contains;

constexpr int kCup = 41, kBook = 73, kBottle = 39, kPerson = 0;
const Camera kPresenceCamera = synthetic::World().camera;

std::vector<synthetic::TrueObject> PresenceTable() {
  return {synthetic::Upright(kCup, {-0.1, 0, 0.06}, {0.05, 0.05, 0.06}),
          synthetic::Upright(kBook, {0.3, -0.3, 0.03}, {0.15, 0.1, 0.03}),
          synthetic::Upright(kBottle, {-0.3, 0.3, 0.12}, {0.04, 0.04, 0.12}),
          synthetic::Upright(62, {0.3, 0.35, 0.15}, {0.2, 0.05, 0.15})};
}

struct Shot {
  Rigid3 cam_from_world;
  std::vector<synthetic::TrueObject> objects;
  synthetic::DetectorOptions detector{.miss_rate = 0.1};
};

KnownPoseMap MapFilm(int frames, const std::function<Shot(int)>& shoot,
                     const ClassRelations& classes = {}) {
  Rng rng(3);
  std::vector<PosedDetections> film;
  for (int i = 0; i < frames; ++i) {
    const Shot shot = shoot(i);
    film.push_back({i, i / 30.0, shot.cam_from_world,
                    synthetic::Detect(shot.objects, shot.cam_from_world, kPresenceCamera,
                                      shot.detector, rng)});
  }
  return MapObjectsFromKnownPoses(film, kPresenceCamera, {}, classes);
}

// The camera moves forth and back in front of the table, 80 degrees in 200 frames.
double Angle(int frame) { return 0.007 * (frame % 400 < 200 ? frame % 400 : 400 - frame % 400); }

std::vector<std::pair<ObjectId, Object>> Mapped(const Map& map, int category_id) {
  std::vector<std::pair<ObjectId, Object>> mapped;
  map.objects.ForEach([&](ObjectId id, const Object& o) {
    if (o.state == ObjectState::kMapped && o.category_id == category_id) mapped.emplace_back(id, o);
  });
  return mapped;
}

// Collects the lines that are logged while it exists.
class Logged {
 public:
  Logged() {
    SetLogSink([this](LogLevel, const std::string& line) { lines_.push_back(line); });
  }
  ~Logged() { SetLogSink({}); }
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  std::vector<std::string> lines_;
};

TEST(Presence, WhatIsTakenAwayIsRemoved) {
  const Logged log;
  const auto film = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    if (i >= 300) shot.objects.erase(shot.objects.begin());
    return shot;
  };
  EXPECT_EQ(Mapped(MapFilm(300, film).map, kCup).size(), 1U);
  EXPECT_EQ(Mapped(MapFilm(330, film).map, kCup).size(), 1U);  // one second is too little evidence
  const Map map = MapFilm(600, film).map;
  EXPECT_EQ(Mapped(map, kCup).size(), 0U);
  for (const int kept : {kBook, kBottle, 62}) EXPECT_EQ(Mapped(map, kept).size(), 1U);
  EXPECT_THAT(
      log.lines(),
      Contains(AllOf(HasSubstr("class 41"), HasSubstr("removed"), HasSubstr("frame 29"))).Times(1));
}

TEST(Presence, ADetectorThatMissesEveryOtherLosesNothing) {
  Rng rng(9);
  int until = 0;
  bool is_missing = false;
  const auto film = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    if (i >= until) {  // misses come in runs of half a second, as with real detectors
      is_missing = rng.Uniform(0, 1) < 0.5;
      until = i + rng.Index(15) + 8;
    }
    if (is_missing) shot.objects.erase(shot.objects.begin());
    return shot;
  };
  const Map map = MapFilm(1500, film).map;
  EXPECT_EQ(Mapped(map, kCup).size(), 1U);
  EXPECT_NEAR(Mapped(map, kCup)[0].second.detection_rate, 0.5, 0.15);
}

TEST(Presence, WhatIsOutOfViewOrSeenFromElsewhereIsNotMissed) {
  const auto front_then_elsewhere = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    if (i < 300) return shot;
    shot.objects.erase(shot.objects.begin());
    if (i < 500)
      shot.cam_from_world = synthetic::LookAt({1.5, 0, 0.7}, {3, 3, 0.5});  // looks away
    else
      shot.cam_from_world =
          OnCircle(3 + 0.4 * Angle(i));  // a detector may not recognise it from behind
    return shot;
  };
  EXPECT_EQ(Mapped(MapFilm(900, front_then_elsewhere).map, kCup).size(), 1U);
}

TEST(Presence, WhatStandsBehindANearerObjectIsNotMissed) {
  // The screen is put in front of the bottle and hides it.
  const auto film = [&](int i) {
    Shot shot{OnCircle(0.4 + 0.4 * Angle(i)), PresenceTable()};
    if (i < 300) return shot;
    shot.objects.erase(shot.objects.begin() + 2);
    const Eigen::Vector3d between =
        0.75 * Eigen::Vector3d(-0.3, 0.3, 0.1) + 0.25 * OnCircle(0.68).OriginInSource();
    shot.objects.push_back(
        synthetic::Upright(63, {between.x(), between.y(), 0.25}, {0.15, 0.15, 0.2}));
    return shot;
  };
  EXPECT_EQ(Mapped(MapFilm(700, film).map, kBottle).size(), 1U);
}

TEST(Presence, WhatAMovingThingHidesIsNotMissed) {
  const ClassRelations classes{{}, {kPerson}};
  const auto film = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    if (i < 300) return shot;
    shot.objects.erase(shot.objects.begin());  // behind the person
    shot.objects.push_back(synthetic::Upright(kPerson, {0.1, 0.05, 0.1}, {0.25, 0.25, 0.3}));
    return shot;
  };
  const Map map = MapFilm(600, film, classes).map;
  EXPECT_EQ(Mapped(map, kCup).size(), 1U);
  map.objects.ForEach([](ObjectId, const Object& o) { EXPECT_NE(o.category_id, kPerson); });
  EXPECT_EQ(Mapped(MapFilm(600, film).map, kCup).size(),
            0U);  // far away, and its class not declared as moving
}

TEST(Presence, WhatIsPutElsewhereUnseenMovesInTheMap) {
  const Logged log;
  const Eigen::Vector3d there(0.05, 0.55, 0.06);
  const auto film = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    if (i >= 300) shot.objects[0].ellipsoid.center = there;
    return shot;
  };
  const ObjectId before = Mapped(MapFilm(300, film).map, kCup)[0].first;
  const Map map = MapFilm(650, film).map;
  const auto cups = Mapped(map, kCup);
  ASSERT_EQ(cups.size(), 1U);
  EXPECT_EQ(cups[0].first, before);
  EXPECT_LT((cups[0].second.ellipsoid.center - there).norm(), 0.02);
  EXPECT_TRUE(cups[0].second.has_moved);
  EXPECT_GE(cups[0].second.observations.front().frame_index, 300);
  EXPECT_THAT(log.lines(), Contains(AllOf(HasSubstr("class 41"), HasSubstr("has moved"))).Times(1));
  EXPECT_THAT(log.lines(), Not(Contains(HasSubstr("removed"))));
  EXPECT_TRUE(map.CheckInvariants().empty());
}

TEST(Presence, WhatIsCarriedAwayInViewMovesInTheMap) {
  const Eigen::Vector3d here = PresenceTable()[0].ellipsoid.center, there(0.1, 0.5, 0.06);
  const auto film = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    const double way = std::clamp((i - 300) / 60.0, 0.0, 1.0);
    shot.objects[0].ellipsoid.center = here + way * (there - here);
    return shot;
  };
  const Map map = MapFilm(800, film).map;
  const auto cups = Mapped(map, kCup);
  ASSERT_EQ(cups.size(), 1U);
  EXPECT_LT((cups[0].second.ellipsoid.center - there).norm(), 0.03);
}

TEST(Presence, OfTwoOfAClassTheOtherIsNotTakenForIt) {
  const auto film = [&](int i) {
    Shot shot{OnCircle(Angle(i)), PresenceTable()};
    shot.objects.push_back(synthetic::Upright(kCup, {0.25, 0.0, 0.06}, {0.05, 0.05, 0.06}));
    if (i >= 300) shot.objects.erase(shot.objects.begin());
    return shot;
  };
  const Map map = MapFilm(650, film).map;
  const auto cups = Mapped(map, kCup);
  ASSERT_EQ(cups.size(), 1U);
  EXPECT_LT((cups[0].second.ellipsoid.center - Eigen::Vector3d(0.25, 0, 0.06)).norm(), 0.02);
  EXPECT_FALSE(cups[0].second.has_moved);
}

TEST(Presence, EvidenceIsBoundedBelowAndKnowsTheRate) {
  Object sure, unsure;
  sure.total_observations = unsure.total_observations = 200;
  sure.detection_rate = 0.9;
  unsure.detection_rate = 0.4;
  for (int i = 0; i < 100; ++i) {
    WeighPlace(PlaceEvidence::kInPlace, kVideoInterval, sure);
    EXPECT_EQ(sure.absence, 0);
  }
  int sure_frames = 0, unsure_frames = 0;
  for (; !IsProvenAbsent(sure.absence); ++sure_frames)
    WeighPlace(PlaceEvidence::kAbsent, kVideoInterval, sure);
  for (; !IsProvenAbsent(unsure.absence); ++unsure_frames)
    WeighPlace(PlaceEvidence::kAbsent, kVideoInterval, unsure);
  EXPECT_GT(sure_frames, 60);
  EXPECT_GT(unsure_frames, 2 * sure_frames);
}

TEST(Presence, IsWeighedByTime) {
  Object object;
  object.total_observations = 200;
  object.detection_rate = 0.8;
  const auto seconds = [&](double interval) {
    Object gone = object;
    int images = 0;
    for (; !IsProvenAbsent(gone.absence); ++images)
      WeighPlace(PlaceEvidence::kAbsent, interval, gone);
    return images * interval;
  };
  EXPECT_NEAR(seconds(0.1), seconds(1 / 30.0), 0.15);
  EXPECT_NEAR(seconds(1 / 120.0), seconds(1 / 30.0), 0.15);
  EXPECT_GT(seconds(1), 7);  // an image counts for one view at most
}

}  // namespace
}  // namespace oaslam
