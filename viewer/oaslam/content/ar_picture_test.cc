#include "oaslam/content/ar_picture.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

constexpr double kSize = 1, kDistance = 4;
const cv::Scalar kBackground(210, 90, 160);

// The principal point is off centre, as in a cropped image.
Camera OffCentre() {
  return {.width = 320, .height = 240, .fx = 300, .fy = 290, .cx = 190.3, .cy = 99.2};
}

// An anchor whose content the first keyframe sees upright from its front, `kDistance` ahead, at
// half its height.
Map MapWith(const std::string& model) {
  Map map;
  map.keyframes.Insert(KeyframeId(0), Keyframe());
  const Eigen::Quaterniond half_turn_about_x(0, 1, 0, 0);  // y up and z towards the camera
  Anchor& anchor = map.anchors["it"];
  anchor.model = model;
  anchor.size = kSize;
  anchor.keyframe = KeyframeId(0);
  anchor.cam_from_anchor = {half_turn_about_x, Eigen::Vector3d(0, kSize / 2, kDistance)};
  return map;
}

void AddEllipsoid(Map& map, const Eigen::Vector3d& center, double radius) {
  Object object;
  object.state = ObjectState::kMapped;
  object.ellipsoid = {center, Eigen::Vector3d::Constant(radius), Eigen::Quaterniond::Identity()};
  map.objects.Insert(ObjectId(static_cast<uint32_t>(map.objects.size())), object);
}

// The pixels that the content changes.
cv::Mat Drawn(const Map& map, const Rigid3& cam_from_world = {}) {
  const ModelLibrary models;
  const ArFrame frame{.camera = OffCentre(), .cam_from_world = cam_from_world, .map = &map};
  cv::Mat picture(frame.camera.height, frame.camera.width, CV_8UC3, kBackground), changed;
  DrawContent(frame, models, picture);
  cv::inRange(picture, kBackground, kBackground, changed);
  return 255 - changed;
}

// The nearest face of a cube, in pixels.
struct Face {
  double left, top, right, bottom;
};
Face FrontOfCube() {
  const Camera camera = OffCentre();
  const double depth = kDistance - kSize / 2, x = camera.fx * kSize / 2 / depth,
               y = camera.fy * kSize / 2 / depth;
  return {camera.cx - x, camera.cy - y, camera.cx + x, camera.cy + y};
}

TEST(DrawContent, ACubeCoversItsProjection) {
  const cv::Mat changed = Drawn(MapWith("cube"));
  const Face face = FrontOfCube();
  int inside = 0;
  // Below it is its shadow.
  for (int y = 0; y < static_cast<int>(face.bottom); ++y)
    for (int x = 0; x < changed.cols; ++x) {
      const double depth_inside = std::min({x - face.left, face.right - x, y - face.top});
      if (depth_inside > 0.5) {
        ASSERT_TRUE(changed.at<uchar>(y, x)) << x << " " << y;
        ++inside;
      }
      // The shadow is visible behind the lower corners of the front.
      if (depth_inside < -0.5 && y < face.top + 0.5 * (face.bottom - face.top)) {
        ASSERT_FALSE(changed.at<uchar>(y, x)) << x << " " << y;
      }
    }
  EXPECT_GT(inside, 5000);
}

TEST(DrawContent, IsHiddenByAnEllipsoidBefore) {
  Map map = MapWith("cube");
  AddEllipsoid(map, {0, 0, kDistance / 2}, 1);
  EXPECT_EQ(cv::countNonZero(Drawn(map)), 0);
  // A ball hides a part: the right end of its outline is in the middle of the cube.
  map = MapWith("cube");
  AddEllipsoid(map, {-0.5, 0, 2},
               0.485);  // sin(atan(0.5 / 2)) * hypot(0.5, 2): it touches the axis
  const cv::Mat changed = Drawn(map);
  const Face face = FrontOfCube();
  const Camera camera = OffCentre();
  EXPECT_FALSE(changed.at<uchar>(static_cast<int>(camera.cy), static_cast<int>(camera.cx - 4)));
  EXPECT_TRUE(changed.at<uchar>(static_cast<int>(camera.cy), static_cast<int>(camera.cx + 4)));
  EXPECT_TRUE(changed.at<uchar>(static_cast<int>(face.top + 2), static_cast<int>(face.right - 2)));
}

TEST(DrawContent, IsNotHiddenByAnEllipsoidBehindOrNotMapped) {
  const cv::Mat alone = Drawn(MapWith("cube"));
  Map map = MapWith("cube");
  AddEllipsoid(map, {0, 0, kDistance + 3}, 2);
  EXPECT_EQ(cv::countNonZero(Drawn(map) != alone), 0);
  AddEllipsoid(map, {0, 0, kDistance / 2}, 1);
  map.objects.Mutable(ObjectId(1))->state = ObjectState::kInitialized;
  EXPECT_EQ(cv::countNonZero(Drawn(map) != alone), 0);
}

TEST(DrawContent, IsNotHiddenByWhatItStandsIn) {
  const cv::Mat alone = Drawn(MapWith("cube"));
  Map map = MapWith("cube");
  AddEllipsoid(map, {0, 1, kDistance}, 0.7);  // the ellipsoid of a table bulges over its top
  EXPECT_EQ(cv::countNonZero(Drawn(map) != alone), 0);
}

TEST(DrawContent, BehindTheCameraThereIsNothing) {
  const Rigid3 turned(Eigen::Quaterniond(0, 0, 1, 0), Eigen::Vector3d::Zero());
  EXPECT_EQ(cv::countNonZero(Drawn(MapWith("robot"), turned)), 0);
}

// Where the camera is inside of content, its nearest parts are cut away and the rest is drawn in
// its place.
TEST(DrawContent, IsCutBeforeTheCamera) {
  const Rigid3 inside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -kDistance));
  EXPECT_GT(cv::countNonZero(Drawn(MapWith("cube"), inside)), 320 * 240 * 9 / 10);
}

TEST(DrawContent, AnUnknownModelIsAWireBox) {
  const cv::Mat changed = Drawn(MapWith("castle"));
  const Face face = FrontOfCube();
  const double middle = (face.left + face.right) / 2;
  EXPECT_TRUE(changed.at<uchar>(static_cast<int>(face.top + 1.5), static_cast<int>(middle)));
  EXPECT_FALSE(
      changed.at<uchar>(static_cast<int>((face.top + face.bottom) / 2), static_cast<int>(middle)));
}

TEST(DrawContent, GoesWithTheAnchor) {
  Map map = MapWith("cube");
  const int near = cv::countNonZero(Drawn(map));
  map.Scale(2);
  EXPECT_EQ(map.anchors.at("it").size, 2 * kSize);
  EXPECT_NEAR(cv::countNonZero(Drawn(map)), near,
              2);                                 // the same picture of a world in another unit
  map.anchors.at("it").keyframe = KeyframeId(3);  // not in the map
  EXPECT_EQ(cv::countNonZero(Drawn(map)), 0);
}

TEST(DrawArPicture, OfALostCameraHasTheStateAlone) {
  Map map = MapWith("cube");
  AddEllipsoid(map, {0, 0, kDistance}, 1);
  const ModelLibrary models;
  ArFrame frame{.camera = OffCentre(), .map = &map, .state = "lost"};
  const cv::Mat before(240, 320, CV_8UC3, kBackground);
  cv::Mat picture = before.clone();
  DrawArPicture(frame, models, CocoClassNames(), picture);
  EXPECT_EQ(cv::norm(picture.rowRange(0, 220), before.rowRange(0, 220), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(picture.rowRange(220, 240), before.rowRange(220, 240), cv::NORM_INF), 50);
  frame.cam_from_world = Rigid3();
  cv::Mat tracked = before.clone();
  DrawArPicture(frame, models, CocoClassNames(), tracked);
  EXPECT_GT(cv::norm(tracked.rowRange(0, 220), before.rowRange(0, 220), cv::NORM_INF), 50);
  frame.map = nullptr;
  DrawArPicture(frame, models, CocoClassNames(), tracked);
}

}  // namespace
}  // namespace oaslam
