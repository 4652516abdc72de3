#include "matchers.h"
#include "oaslam/anchors/editing.h"
#include "oaslam/anchors/placement.h"
#include "oaslam/anchors/ray_cast.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

const Eigen::Vector3d kUp(0, -1, 0);  // of level cameras

// Two cameras in front of a level table of landmarks 1 below them, with a cup on it.
Map Table() {
  Map map = synthetic::EmptyMap(
      {.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 319.5, .cy = 239.5});
  Rng rng(7);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 200; ++i)
    points.emplace_back(rng.Uniform(-1, 1), 1 + rng.Gaussian(0.003), rng.Uniform(2, 4));
  for (uint32_t k = 0; k < 2; ++k)
    map.keyframes.Insert(
        KeyframeId(k),
        synthetic::BlankKeyframe({Rigid3::Rotation::Identity(), {-0.2 * k, 0, 0}}, points.size()));
  for (uint32_t i = 0; i < points.size(); ++i) {
    const LandmarkId id = map.AddLandmark(points[i], KeyframeId(0));
    for (uint32_t k = 0; k < 2; ++k) map.AddObservation(id, KeyframeId(k), i);
  }
  Object cup;
  cup.state = ObjectState::kMapped;
  cup.ellipsoid = {{0.3, 0.9, 3},
                   {0.05, 0.05, 0.1},
                   Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitX()))};
  cup.observations.emplace_back().reference = KeyframeId(1);
  map.objects.Insert(ObjectId(4), cup);
  return map;
}

AnchorRequest Click(const Eigen::Vector3d& at) { return {.model = "flag", .direction = 3 * at}; }

TEST(Anchors, StandOnThePlaneOfThePoints) {
  const Map map = Table();
  const Placement placement = FindPlace(map, Click({0.1, 1, 3}));
  ASSERT_TRUE(placement.anchor) << placement.why_not;
  const Rigid3 pose = *WorldFromAnchor(map, *placement.anchor);
  EXPECT_LT((pose.translation - Eigen::Vector3d(0.1, 1, 3)).norm(), 0.03);
  EXPECT_GT((pose.rotation * Eigen::Vector3d::UnitY()).dot(kUp), 0.995);
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ()).z(),
            -0.99);  // faces the viewer who placed it
  EXPECT_NEAR(placement.anchor->size, 0.12 * std::sqrt(10.01), 0.01);
}

TEST(Anchors, ALevelPlaneIsPreferredWhereUpIsKnown) {
  Map map = Table();
  map.up = Eigen::Vector3d(0.01, -1, 0).normalized();
  const Placement placement = FindPlace(map, Click({0.1, 1, 3}));
  ASSERT_TRUE(placement.anchor);
  EXPECT_GT(
      (WorldFromAnchor(map, *placement.anchor)->rotation * Eigen::Vector3d::UnitY()).dot(*map.up),
      1 - 1e-9);
}

TEST(Anchors, StandOnTopOfAnObjectAndGoWithIt) {
  Map map = Table();
  AnchorRequest request = Click({0.3, 0.9, 3});
  request.object = ObjectId(4);
  const Placement placement = FindPlace(map, request);
  ASSERT_TRUE(placement.anchor) << placement.why_not;
  const Eigen::Vector3d top(0.3, 0.8, 3);  // the longest axis stands upright
  EXPECT_LT((WorldFromAnchor(map, *placement.anchor)->translation - top).norm(), 1e-9);
  const Eigen::Vector3d moved(-0.5, 0, 1);
  map.objects.MutableAt(ObjectId(4)).ellipsoid.center += moved;
  EXPECT_LT((WorldFromAnchor(map, *placement.anchor)->translation - (top + moved)).norm(), 1e-9);
  map.objects.Erase(ObjectId(4));  // the content stays in its place
  EXPECT_LT((WorldFromAnchor(map, *placement.anchor)->translation - top).norm(), 1e-9);
}

TEST(Anchors, GoWithTheirKeyframesAndTheUnit) {
  Map map = Table();
  const AnchorReport report = PlaceAnchor(map, Click({0, 1, 3}), map.anchors);
  ASSERT_EQ(report.name, "flag 1") << report.why_not;
  const Rigid3 before = PosesOf(map).at(0).world_from_anchor;
  const Rigid3 correction(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())),
                          {1, 2, 3});
  for (const KeyframeId id : map.keyframes.Ids()) {
    Rigid3& pose = map.keyframes.MutableAt(id).cam_from_world;
    pose = pose * correction.Inverse();
  }
  const Rigid3 after = PosesOf(map).at(0).world_from_anchor;
  EXPECT_LT((after.translation - correction * before.translation).norm(), 1e-9);
  EXPECT_LT(after.rotation.angularDistance(correction.rotation * before.rotation), 1e-9);
  const double size = map.anchors.at("flag 1").size;
  map.Scale(2);
  EXPECT_LT((PosesOf(map).at(0).world_from_anchor.translation - 2 * after.translation).norm(),
            1e-9);
  EXPECT_DOUBLE_EQ(map.anchors.at("flag 1").size, 2 * size);
  map.RetireKeyframe(map.anchors.at("flag 1").keyframe);
  EXPECT_LT((PosesOf(map).at(0).world_from_anchor.translation - 2 * after.translation).norm(),
            1e-9);
}

TEST(Anchors, RefuseWhatIsNoPlace) {
  const Map map = Table();
  EXPECT_THAT(FindPlace(map, Click({0, 0, 0})).why_not, HasSubstr("no direction"));
  EXPECT_THAT(FindPlace(map, Click({0, -1, 3})).why_not, HasSubstr("too few landmarks"));
  EXPECT_THAT(FindPlace(map, Click({0, std::nan(""), 3})).why_not, HasSubstr("no direction"));
  AnchorRequest request = Click({0, 1, 3});
  request.size = -1;
  EXPECT_THAT(FindPlace(map, request).why_not, HasSubstr("must be from"));
  request = Click({0.3, 0.9, 3});
  request.object = ObjectId(5);
  EXPECT_THAT(FindPlace(map, request).why_not, HasSubstr("no object 5"));
}

TEST(CastRay, MeetsWhatIsOnItsWayTheNearestFirst) {
  const Map map = Table();
  // Past the cup, down to the table.
  const std::vector<RayHit> past = CastRay(map, {0, 0, 0}, 2 * Eigen::Vector3d(-0.2, 1, 3));
  ASSERT_FALSE(past.empty());
  const auto plane = std::ranges::find(past, HitKind::kPlane, &RayHit::kind);
  ASSERT_NE(plane, past.end());
  EXPECT_LT((plane->position - Eigen::Vector3d(-0.2, 1, 3)).norm(), 0.03);
  EXPECT_NEAR(plane->distance, std::sqrt(0.04 + 1 + 9), 0.03);
  EXPECT_GT(plane->normal.dot(kUp), 0.99);
  EXPECT_FALSE(plane->object || plane->landmark);
  EXPECT_TRUE(std::ranges::none_of(past, [](const RayHit& hit) { return hit.object.has_value(); }));

  const std::vector<RayHit> cup = CastRay(map, {0, 0, 0}, {0.3, 0.9, 3});
  ASSERT_GE(cup.size(), 2U);
  EXPECT_TRUE(std::ranges::is_sorted(cup, {}, &RayHit::distance));
  EXPECT_EQ(cup[0].kind, HitKind::kObject);
  EXPECT_EQ(cup[0].object, ObjectId(4));
  // Its front is a radius before its centre, and looks at the camera.
  const Eigen::Vector3d to_cup(0.3, 0.9, 3);
  EXPECT_NEAR(cup[0].distance, to_cup.norm() - 0.05, 0.01);
  EXPECT_LT(cup[0].normal.dot(to_cup.normalized()), -0.9);
  EXPECT_NEAR(cup[0].normal.norm(), 1, 1e-9);
}

TEST(CastRay, MeetsNothingBehindItsOriginOrAroundIt) {
  const Map map = Table();
  EXPECT_TRUE(CastRay(map, {0, 0, 0}, {0, -1, -3}).empty());
  for (const RayHit& hit : CastRay(map, {0.3, 0.9, 3}, {0, 0, 1}))  // from within the cup
    EXPECT_NE(hit.kind, HitKind::kObject);
}

TEST(CastRay, ALandmarkIsMetWithinADegree) {
  const Map map = Table();
  const Eigen::Vector3d& at = map.landmarks.At(LandmarkId(7)).position;
  const std::vector<RayHit> hits = CastRay(map, {0, 0, 0}, at);
  const auto landmark = std::ranges::find(hits, HitKind::kLandmark, &RayHit::kind);
  ASSERT_NE(landmark, hits.end());
  EXPECT_EQ(landmark->landmark, LandmarkId(7));
  EXPECT_EQ(landmark->position, at);
  EXPECT_EQ(landmark->normal, Eigen::Vector3d(0, 0, 0));
}

TEST(Anchors, RefuseAPoseThatIsNone) {
  const Map map = Table();
  const auto is_placed = [&](const Rigid3& pose) {
    Anchors anchors;
    const AnchorReport placed = PlaceAnchor(map, {.model = "flag", .pose = pose}, anchors);
    Anchors edited = {{"it", Anchor{"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}}}};
    const AnchorReport moved = EditAnchor(map, "it", {.pose = pose}, edited);
    EXPECT_EQ(placed.IsDone(), moved.IsDone());
    EXPECT_EQ(anchors.size(), placed.IsDone() ? 1U : 0U);
    if (!placed.IsDone()) {
      EXPECT_THAT(placed.why_not, HasSubstr("no unit quaternion"));
    }
    return placed.IsDone();
  };
  Rigid3 pose;
  EXPECT_TRUE(is_placed(pose));
  for (const Eigen::Vector4d& q :
       {Eigen::Vector4d(0, 0, 0, 0), Eigen::Vector4d(0, 0, 0, 1e-30), Eigen::Vector4d(0, 0, 0, 2),
        Eigen::Vector4d(NAN, 0, 0, 1), Eigen::Vector4d(INFINITY, 0, 0, 0)}) {
    pose.rotation.coeffs() = q;
    EXPECT_FALSE(is_placed(pose)) << q.transpose();
  }
}

TEST(Anchors, AreNamedTurnedSizedAndRenamed) {
  const Map map = Table();
  Anchors anchors;
  EXPECT_EQ(PlaceAnchor(map, Click({0, 1, 3}), anchors).name, "flag 1");
  EXPECT_EQ(PlaceAnchor(map, Click({0, 1, 2.5}), anchors).name, "flag 2");
  AnchorRequest named = Click({0, 1, 3});
  named.name = "door";
  EXPECT_EQ(PlaceAnchor(map, named, anchors).name, "door");
  EXPECT_THAT(PlaceAnchor(map, named, anchors).why_not, HasSubstr("already"));
  named.name = "a=b";  // as the command line separates names
  EXPECT_THAT(PlaceAnchor(map, named, anchors).why_not, HasSubstr("control character or"));
  named.name = "a\nb";
  EXPECT_THAT(PlaceAnchor(map, named, anchors).why_not, HasSubstr("control character"));

  named.name = "one more";
  named.model = std::string(65, 'x');
  EXPECT_THAT(PlaceAnchor(map, named, anchors).why_not, HasSubstr("name of a model"));

  const Rigid3 before = anchors.at("door").cam_from_anchor;
  EXPECT_EQ(
      EditAnchor(map, "door", {.name = "gate", .size = 0.5, .turn_rad = M_PI / 2}, anchors).name,
      "gate");
  ASSERT_FALSE(anchors.contains("door"));
  const Anchor& gate = anchors.at("gate");
  EXPECT_EQ(gate.size, 0.5);
  EXPECT_EQ(gate.cam_from_anchor.translation, before.translation);
  const Eigen::Vector3d x =
      before.rotation.conjugate() * (gate.cam_from_anchor.rotation * Eigen::Vector3d::UnitZ());
  EXPECT_LT((x - Eigen::Vector3d::UnitX()).norm(), 1e-9);

  const auto problem = [&](const std::string& name, const AnchorEdit& edit) {
    const AnchorReport report = EditAnchor(map, name, edit, anchors);
    EXPECT_EQ(report.IsDone(), !report.name.empty());
    return report.why_not;
  };
  EXPECT_THAT(problem("gate", {.name = "flag 1"}), HasSubstr("already"));
  EXPECT_THAT(problem("gate", {.size = 0.}), HasSubstr("must be from 1e-06 to"));
  EXPECT_THAT(problem("none", {}), HasSubstr("no anchor \"none\""));
  EXPECT_EQ(anchors.at("gate").size, 0.5);

  EXPECT_EQ(RemoveAnchor("gate", anchors).name, "gate");
  EXPECT_THAT(RemoveAnchor("gate", anchors).why_not, HasSubstr("no anchor \"gate\""));
}

}  // namespace
}  // namespace oaslam
