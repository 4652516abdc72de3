#include "oaslam/objects/sight_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "oaslam/objects/object_mapper.h"
#include "oaslam/objects/presence.h"
#include "object_film.h"

namespace oaslam {
namespace {

constexpr double kRadius = 0.12;
const Eigen::Vector3d kPlace(0, 0, 0.3);

// A camera that walks to the left and comes back, past a ball in front of a wall. It sees every
// landmark that the ball does not hide, and others on the ball.
class Hall {
 public:
  enum class Ball { kThere, kGone, kOfGlass };

  Hall() {
    for (double x = -2; x <= 2; x += 0.08)
      for (double z = -0.5; z <= 1.5; z += 0.08) wall_.push_back(Add({x, 1, z}));
    for (double x = -0.09; x <= 0.09; x += 0.03)
      for (double z = -0.06; z <= 0.06; z += 0.03) {
        const double depth = std::sqrt(kRadius * kRadius - x * x - z * z);
        ball_.push_back(Add(kPlace + Eigen::Vector3d(x, -depth, z)));
      }
  }

  // Adds a pass of six keyframes at y, which look at the wall or are turned away by an angle.
  std::vector<KeyframeId> Pass(Ball ball, double y = -2, double turned = 0) {
    std::vector<KeyframeId> pass;
    for (int i = 0; i < 6; ++i) pass.push_back(AddKeyframe({-0.5 + 0.2 * i, y, 0.5}, turned, ball));
    for (const KeyframeId id : pass) map_.UpdateCovisibility(id);
    return pass;
  }

  // The ball as an object that was detected in keyframes.
  ObjectId Map(const std::vector<KeyframeId>& keyframes) {
    Object object = MappedObject(synthetic::Upright(0, kPlace, Eigen::Vector3d::Constant(kRadius)));
    object.total_observations = 60;
    for (const KeyframeId id : keyframes)
      object.observations.push_back({map_.keyframes.At(id).frame_index, id, {}, 0, {}});
    object.last_seen_frame = object.observations.back().frame_index;
    const ObjectId id(0);
    map_.objects.Insert(id, object);
    return id;
  }

  oaslam::Map& map() { return map_; }

 private:
  LandmarkId Add(const Eigen::Vector3d& position) {
    return map_.AddLandmark(position, KeyframeId(0));
  }

  static bool IsHidden(const Eigen::Vector3d& eye, const Eigen::Vector3d& point) {
    const Eigen::Vector3d line = (point - eye).normalized(), to_ball = kPlace - eye;
    return (to_ball - line * line.dot(to_ball)).norm() < kRadius;
  }

  KeyframeId AddKeyframe(const Eigen::Vector3d& eye, double turned, Ball ball) {
    std::vector<LandmarkId> seen;
    for (const LandmarkId id : wall_)
      if (ball != Ball::kThere || !IsHidden(eye, map_.landmarks.At(id).position))
        seen.push_back(id);
    if (ball != Ball::kGone) seen.insert(seen.end(), ball_.begin(), ball_.end());
    const Eigen::Vector3d ahead(std::sin(turned), std::cos(turned), 0);
    Keyframe keyframe = synthetic::BlankKeyframe(synthetic::LookAt(eye, eye + ahead), seen.size());
    keyframe.frame_index = 10 * static_cast<int>(next_);
    const KeyframeId id(next_++);
    map_.keyframes.Insert(id, std::move(keyframe));
    for (size_t i = 0; i < seen.size(); ++i)
      map_.AddObservation(seen[i], id, static_cast<uint32_t>(i));
    return id;
  }

  oaslam::Map map_ = synthetic::EmptyMap();
  std::vector<LandmarkId> wall_, ball_;
  uint32_t next_ = 0;
};

TEST(SightLines, StopAtWhatIsThereAndPassWhereItWas) {
  Hall hall;
  const auto before = hall.Pass(Hall::Ball::kThere), after = hall.Pass(Hall::Ball::kGone);
  const Ellipsoid& ball = hall.map().objects.At(hall.Map(before)).ellipsoid;
  const SightLines there = CountSightLines(hall.map(), ball, before),
                   gone = CountSightLines(hall.map(), ball, after);
  EXPECT_EQ(there.through, 0);
  EXPECT_GT(there.stopped, 5);
  EXPECT_GT(gone.through, 8);
  EXPECT_EQ(gone.stopped, 0);
}

TEST(SightLines, ProveThatAThingIsGone) {
  Hall hall;
  const ObjectId ball = hall.Map(hall.Pass(Hall::Ball::kThere));
  const auto again = hall.Pass(Hall::Ball::kThere);
  EXPECT_LE(SeenThroughEvidence(hall.map(), hall.map().objects.At(ball), again), 0);
  const auto after = hall.Pass(Hall::Ball::kGone);
  EXPECT_TRUE(IsProvenAbsent(SeenThroughEvidence(hall.map(), hall.map().objects.At(ball), after)));
}

TEST(SightLines, SayNothingOfWhatOneLooksThrough) {
  Hall hall;
  const ObjectId glass = hall.Map(hall.Pass(Hall::Ball::kOfGlass));
  const auto again = hall.Pass(Hall::Ball::kOfGlass);
  EXPECT_FALSE(
      IsProvenAbsent(SeenThroughEvidence(hall.map(), hall.map().objects.At(glass), again)));
}

TEST(SightLines, SayNothingBeforeTheLastDetection) {
  Hall hall;
  const auto before = hall.Pass(Hall::Ball::kGone), after = hall.Pass(Hall::Ball::kThere);
  const ObjectId ball = hall.Map(after);
  EXPECT_EQ(SeenThroughEvidence(hall.map(), hall.map().objects.At(ball), before), 0);
}

TEST(SightLines, SayNothingWhereOneInFiveStops) {
  Hall hall;
  const ObjectId ball = hall.Map(hall.Pass(Hall::Ball::kThere));
  const Object& object = hall.map().objects.At(ball);
  // Something transparent stands there, as a chair does.
  const auto after = hall.Pass(Hall::Ball::kOfGlass);
  const SightLines lines = CountSightLines(hall.map(), object.ellipsoid, after);
  ASSERT_GT(lines.through, 8);
  ASSERT_GT(5 * lines.stopped, lines.through + lines.stopped);
  EXPECT_EQ(SeenThroughEvidence(hall.map(), object, after), 0);
}

TEST(SightLines, SayNothingFromFartherThanItIsDetectedFrom) {
  for (const double y : {-2.5, -4.0}) {
    Hall hall;
    const ObjectId ball = hall.Map(hall.Pass(Hall::Ball::kThere));
    const Object& object = hall.map().objects.At(ball);
    const auto after = hall.Pass(Hall::Ball::kGone, y);
    EXPECT_GT(CountSightLines(hall.map(), object.ellipsoid, after).through, 0) << y;
    EXPECT_EQ(SeenThroughEvidence(hall.map(), object, after) > 0, y > -3) << y;
  }
}

TEST(SightLines, SayNothingOfWhatIsNotInTheImage) {
  for (const double turned : {0.2, 1.5, 3.0}) {
    Hall hall;
    const ObjectId ball = hall.Map(hall.Pass(Hall::Ball::kThere));
    const auto after = hall.Pass(Hall::Ball::kGone, -2, turned);
    EXPECT_EQ(SeenThroughEvidence(hall.map(), hall.map().objects.At(ball), after) > 0, turned < 1)
        << turned;
  }
}

TEST(SightLines, SayNothingWhereThePlaceIsNotKnownFromCommonLandmarks) {
  Hall hall;
  const ObjectId ball = hall.Map(hall.Pass(Hall::Ball::kThere));
  auto after = hall.Pass(Hall::Ball::kGone);
  // The new pass sees landmarks of its own, although they are in the same places.
  Map& map = hall.map();
  for (const KeyframeId id : after)
    for (const LandmarkId landmark : std::vector(map.keyframes.At(id).landmarks)) {
      if (!landmark.IsValid()) continue;
      const LandmarkId copy = map.AddLandmark(map.landmarks.At(landmark).position, id);
      const auto& seen = map.keyframes.At(id).landmarks;
      const auto keypoint = static_cast<uint32_t>(std::ranges::find(seen, landmark) - seen.begin());
      map.EraseObservation(landmark, id);
      map.AddObservation(copy, id, keypoint);
    }
  for (const KeyframeId id : map.keyframes.Ids()) map.UpdateCovisibility(id);
  EXPECT_EQ(SeenThroughEvidence(map, map.objects.At(ball), after), 0);
}

TEST(SightLines, FromInsideAThingTellNothing) {
  Hall hall;
  const auto pass = hall.Pass(Hall::Ball::kGone);
  // Wide and low, so that the cameras are above it.
  const Ellipsoid bed{{0, -1.5, 0.4}, {2, 2, 1}, Eigen::Quaterniond::Identity()};
  EXPECT_EQ(CountSightLines(hall.map(), bed, pass).through, 0);
}

TEST(SightLines, WhatTheyProveGoneIsErased) {
  Hall hall;
  const ObjectId ball = hall.Map(hall.Pass(Hall::Ball::kThere));
  ReviewPlaces({}, hall.map());
  EXPECT_TRUE(hall.map().objects.Contains(ball));
  hall.Pass(Hall::Ball::kGone);
  ReviewPlaces({}, hall.map());
  EXPECT_FALSE(hall.map().objects.Contains(ball));
}

}  // namespace
}  // namespace oaslam
