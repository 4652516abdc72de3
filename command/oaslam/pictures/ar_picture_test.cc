#include "oaslam/pictures/ar_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace oaslam {
namespace {

constexpr double kSize = 1, kDistance = 4;
const cv::Scalar kBackground(210, 90, 160);
constexpr int kStatusRows = 20;  // at the bottom

// The principal point is off centre, as in a cropped image.
Camera OffCentre() {
  return {.width = 320, .height = 240, .fx = 300, .fy = 290, .cx = 190.3, .cy = 99.2};
}

// An anchor that the first keyframe sees upright from its front, `kDistance` ahead, with the middle
// of its height on the optical axis.
Map MapWithAnchor() {
  Map map;
  map.keyframes.Insert(KeyframeId(0), Keyframe());
  const Eigen::Quaterniond half_turn_about_x(0, 1, 0, 0);  // y up and z towards the camera
  Anchor& anchor = map.anchors["it"];
  anchor.model = "cube";
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

cv::Mat Drawn(const Map& map, const std::optional<Rigid3>& cam_from_world = Rigid3()) {
  const ArFrame frame{
      .camera = OffCentre(), .cam_from_world = cam_from_world, .map = &map, .state = "tracking"};
  cv::Mat picture(frame.camera.height, frame.camera.width, CV_8UC3, kBackground);
  DrawArPicture(frame, CocoClassNames(), picture);
  return picture;
}

// Pixels above the status line that are not of the background.
cv::Mat Changed(const cv::Mat& picture) {
  cv::Mat background;
  cv::inRange(picture, kBackground, kBackground, background);
  const cv::Mat changed = 255 - background;
  return changed.rowRange(0, picture.rows - kStatusRows);
}

// Whether a line of this colour goes through a point, or beside it by less than a pixel.
bool IsColored(const cv::Mat& picture, double x, double y, const cv::Scalar& color) {
  const auto distance = [&](int column, int row) {
    const auto is = picture.at<cv::Vec3b>(row, column);
    return std::abs(is[0] - color[0]) + std::abs(is[1] - color[1]) + std::abs(is[2] - color[2]);
  };
  const int column = static_cast<int>(std::lround(x)), row = static_cast<int>(std::lround(y));
  double nearest = 1000;
  for (const int dx : {-1, 0, 1})
    for (const int dy : {-1, 0, 1}) nearest = std::min(nearest, distance(column + dx, row + dy));
  return nearest < 150;
}

TEST(DrawArPicture, AnAnchorIsItsAxes) {
  const cv::Mat picture = Drawn(MapWithAnchor());
  const Camera camera = OffCentre();
  const double height = camera.fy * kSize / kDistance, side = camera.fx * kSize / 2 / kDistance,
               foot = camera.cy + height / 2;
  EXPECT_TRUE(IsColored(picture, camera.cx, camera.cy, {80, 205, 80}));         // y
  EXPECT_TRUE(IsColored(picture, camera.cx + side - 3, foot, {60, 60, 235}));   // x
  EXPECT_FALSE(IsColored(picture, camera.cx + side + 4, foot, {60, 60, 235}));  // its end
  EXPECT_FALSE(IsColored(picture, camera.cx - side / 2, camera.cy, {80, 205, 80}));
}

TEST(DrawArPicture, AnAnchorGoesWithItsKeyframe) {
  Map map = MapWithAnchor();
  const int alone = cv::countNonZero(Changed(Drawn(map)));
  EXPECT_GT(alone, 50);
  map.Scale(2);
  // The same picture of a world in another unit.
  EXPECT_NEAR(cv::countNonZero(Changed(Drawn(map))), alone, 2);
  map.anchors.at("it").keyframe = KeyframeId(3);  // not in the map
  EXPECT_EQ(cv::countNonZero(Changed(Drawn(map))), 0);
}

TEST(DrawArPicture, ObjectsHaveOutlines) {
  Map map;
  map.keyframes.Insert(KeyframeId(0), Keyframe());
  AddEllipsoid(map, {0, 0, kDistance}, 0.5);
  const cv::Mat changed = Changed(Drawn(map));
  const Camera camera = OffCentre();
  const double radius = camera.fx * 0.5 / kDistance;
  int on_outline = 0;
  for (int dx = -3; dx <= 3; ++dx)
    on_outline += changed.at<uchar>(static_cast<int>(camera.cy),
                                    static_cast<int>(camera.cx + radius) + dx) > 0;
  EXPECT_GT(on_outline, 0);
  EXPECT_FALSE(changed.at<uchar>(static_cast<int>(camera.cy), static_cast<int>(camera.cx)));
  map.objects.Mutable(ObjectId(0))->state = ObjectState::kInitialized;
  EXPECT_EQ(cv::countNonZero(Changed(Drawn(map))), 0);
}

TEST(DrawArPicture, ThePathIsThatOfTheKeyframesInTheOrderOfTime) {
  Map map;
  const std::vector<Eigen::Vector3d> centers = {{-1, 0.3, 4}, {0, 0.3, 4}, {0, -0.3, 4}};
  for (const int i : {2, 0, 1}) {  // the order in the table is another one
    Keyframe keyframe;
    keyframe.timestamp = i;
    keyframe.cam_from_world =
        Rigid3(Eigen::Quaterniond::Identity(), centers[static_cast<size_t>(i)]).Inverse();
    map.keyframes.Insert(KeyframeId(static_cast<uint32_t>(map.keyframes.size())), keyframe);
  }
  const cv::Mat changed = Changed(Drawn(map));
  const Camera camera = OffCentre();
  const auto is_drawn = [&](const Eigen::Vector3d& p) {
    const int x = static_cast<int>(std::lround(camera.cx + camera.fx * p.x() / p.z())),
              y = static_cast<int>(std::lround(camera.cy + camera.fy * p.y() / p.z()));
    return changed.at<uchar>(y, x) > 0;
  };
  EXPECT_TRUE(is_drawn((centers[0] + centers[1]) / 2));
  EXPECT_TRUE(is_drawn((centers[1] + centers[2]) / 2));
  EXPECT_FALSE(is_drawn((centers[0] + centers[2]) / 2));
}

TEST(DrawArPicture, NothingIsDrawnOfWhatIsBehindTheCamera) {
  Map map = MapWithAnchor();
  AddEllipsoid(map, {0, 0, kDistance}, 0.5);
  const Rigid3 turned(Eigen::Quaterniond(0, 0, 1, 0), Eigen::Vector3d::Zero());
  EXPECT_EQ(cv::countNonZero(Changed(Drawn(map, turned))), 0);
}

TEST(DrawArPicture, ACameraInsideAnAnchorSeesTheRestOfIt) {
  const Rigid3 inside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -kDistance + 0.2));
  EXPECT_GT(cv::countNonZero(Changed(Drawn(MapWithAnchor(), inside))), 0);
}

TEST(DrawArPicture, OfALostCameraHasTheStateAlone) {
  Map map = MapWithAnchor();
  AddEllipsoid(map, {0, 0, kDistance}, 1);
  const cv::Mat picture = Drawn(map, std::nullopt);
  EXPECT_EQ(cv::countNonZero(Changed(picture)), 0);
  const cv::Mat strip(kStatusRows, picture.cols, CV_8UC3, kBackground);
  EXPECT_GT(
      cv::norm(picture.rowRange(picture.rows - kStatusRows, picture.rows), strip, cv::NORM_INF),
      50);
}

}  // namespace
}  // namespace oaslam
