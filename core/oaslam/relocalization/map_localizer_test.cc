#include "oaslam/map_localizer.h"

#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "expect_input_error.h"
#include "oaslam/description/describe_features.h"
#include "oaslam/features/features.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "object_film.h"

namespace oaslam {
namespace {

const Camera& kWorldCamera = synthetic::kCamera;

// A camera before a wall with a random pattern, which fills the plane z = 0. It sees it at an
// angle: from straight ahead the place of the camera would be uncertain.
Rigid3 BeforeTheWall(double x, double y, double turn_rad) {
  return Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(0.5 + turn_rad, Eigen::Vector3d::UnitY())),
                Eigen::Vector3d(x - 1, y, -2));
}

cv::Mat ImageOfWall(const Rigid3& world_from_cam) {
  constexpr double kPixelsPerUnit = 300;
  cv::Mat noise(240, 240, CV_8UC1), wall, image;
  cv::RNG(7).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::resize(noise, wall, {1600, 1600}, 0, 0, cv::INTER_CUBIC);
  const Rigid3 cam_from_world = world_from_cam.Inverse();
  Eigen::Matrix3d image_from_wall = cam_from_world.rotation.toRotationMatrix();
  image_from_wall.col(2) = cam_from_world.translation;
  Eigen::Matrix3d calibration, world_from_pattern;
  calibration << kWorldCamera.fx, 0, kWorldCamera.cx, 0, kWorldCamera.fy, kWorldCamera.cy, 0, 0, 1;
  world_from_pattern << 1 / kPixelsPerUnit, 0, -800 / kPixelsPerUnit, 0, 1 / kPixelsPerUnit,
      -800 / kPixelsPerUnit, 0, 0, 1;
  image_from_wall = calibration * image_from_wall * world_from_pattern;
  cv::Mat warp(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) warp.at<double>(r, c) = image_from_wall(r, c);
  cv::warpPerspective(wall, image, warp, {kWorldCamera.width, kWorldCamera.height});
  return image;
}

ImageInput InputOf(const Rigid3& world_from_cam) {
  ImageInput input;
  input.image = ImageOfWall(world_from_cam);
  return input;
}

// The key point of a frame that shows what another one does; -1: none.
int SameIn(const Features& features, const Eigen::Vector2d& px, const Descriptor& descriptor) {
  for (size_t i = 0; i < features.keypoints.size(); ++i)
    if ((features.keypoints[i].px.cast<double>() - px).norm() < 3 &&
        HammingDistance(features.descriptors[i], descriptor) < 60)
      return static_cast<int>(i);
  return -1;
}

// The wall, seen from three places, with objects before it.
SavedMap MapOfWall() {
  SavedMap saved;
  Map& map = saved.map;
  map.cameras = {kWorldCamera};
  const SlamConfig config = SlamConfig::Offline();
  FrameMaker maker(config, kWorldCamera);
  for (uint32_t k = 0; k < 3; ++k) {
    const Rigid3 pose = BeforeTheWall(0.2 * k - 0.2, 0, 0.1 - 0.1 * k);
    Keyframe keyframe;
    keyframe.frame_index = static_cast<int>(k);
    keyframe.timestamp = k;
    keyframe.cam_from_world = pose.Inverse();
    keyframe.features =
        maker.Make(InputOf(pose), static_cast<int>(k), config.features.count, {}).features;
    keyframe.landmarks.resize(keyframe.features->keypoints.size());
    map.keyframes.Insert(KeyframeId(k), std::move(keyframe));
  }
  const Keyframe first = map.keyframes.At(KeyframeId(0));
  const Rigid3 world_from_first = first.cam_from_world.Inverse();
  for (uint32_t i = 0; i < first.features->keypoints.size(); ++i) {
    const Eigen::Vector2d px = first.features->keypoints[i].px.cast<double>();
    const Eigen::Vector3d ray = world_from_first.rotation *
                                Eigen::Vector3d((px.x() - kWorldCamera.cx) / kWorldCamera.fx,
                                                (px.y() - kWorldCamera.cy) / kWorldCamera.fy, 1);
    const Eigen::Vector3d position = world_from_first.translation + 2 / ray.z() * ray;
    std::vector<Observation> seen{{KeyframeId(0), i}};
    for (uint32_t k = 1; k < 3; ++k) {
      const Keyframe& other = map.keyframes.At(KeyframeId(k));
      const int same =
          SameIn(*other.features, ProjectIdeal(kWorldCamera, other.cam_from_world * position),
                 first.features->descriptors[i]);
      if (same >= 0) seen.push_back({KeyframeId(k), static_cast<uint32_t>(same)});
    }
    if (seen.size() >= 2) synthetic::AddLandmark(map, position, seen);
  }
  for (uint32_t k = 0; k < 3; ++k) map.UpdateCovisibility(KeyframeId(k));
  Rng rng(4);
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d center{rng.Uniform(-0.8, 0.8), rng.Uniform(-0.6, 0.6),
                                 rng.Uniform(-0.4, 0)};
    synthetic::AddObject(
        map, WellMappedObject(synthetic::Upright(i, center, {0.05 + 0.01 * i, 0.08, 0.1})));
  }
  return saved;
}

// Of the same map, by its images: learned descriptors, and chance as ORB's.
SavedMap KnownByLearned(SavedMap saved) {
  Rng rng(6);
  for (const KeyframeId id : saved.map.keyframes.Ids()) {
    Keyframe& keyframe = saved.map.keyframes.MutableAt(id);
    const cv::Mat image = ImageOfWall(keyframe.cam_from_world.Inverse());
    Features features = DescribeFeatures(*keyframe.features, kWorldCamera, ViewOf(image));
    for (Descriptor& descriptor : features.descriptors)
      descriptor = synthetic::RandomDescriptor(rng);
    keyframe.learned_depths.resize(features.keypoints.size());
    keyframe.features = std::make_shared<const Features>(std::move(features));
  }
  return saved;
}

std::vector<Detection> DetectionsOf(const Map& map, const Rigid3& world_from_cam) {
  Rng rng(1);
  std::vector<Detection> detections;
  for (const ObjectDetection& d : synthetic::Detect(
           synthetic::ObjectsOf(map), world_from_cam.Inverse(), kWorldCamera, {}, rng))
    detections.push_back({.category_id = d.category_id, .score = d.score, .box = d.box});
  return detections;
}

const RelocalizeOptions kByPoints{.mode = RelocalizationMode::kPoints, .camera = kWorldCamera};

class MapLocalizerTest : public ::testing::Test {
 protected:
  static const MapLocalizer& Shared() {
    static const MapLocalizer localizer = MapLocalizer(SnapshotOf(MapOfWall(), NewWorld(), 1));
    return localizer;
  }
  const MapLocalizer& localizer_ = Shared();
  const Rigid3 pose_ = BeforeTheWall(0.1, 0.05, 0.03);
};

double DistanceBetween(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm();
}

TEST_F(MapLocalizerTest, FindsAnImageByPoints) {
  ASSERT_GT(localizer_.map().Landmarks().size(), 200u);
  const RelocalizationResult found = localizer_.Relocalize(InputOf(pose_), kByPoints);
  ASSERT_TRUE(found.world_from_cam) << found.why_not;
  EXPECT_EQ(found.evidence, PoseEvidence::kPoints);
  EXPECT_LT(DistanceBetween(*found.world_from_cam, pose_), 0.02);
  const RelocalizationResult lost =
      localizer_.Relocalize(InputOf(BeforeTheWall(50, 0, 0)), kByPoints);
  EXPECT_FALSE(lost.world_from_cam);
  EXPECT_THAT(lost.why_not, Not(IsEmpty()));
}

// The image keeps what its descriptors need, also where its camera is not known.
TEST_F(MapLocalizerTest, WhereOrbIsInVainTheImageIsFoundByLearnedDescriptors) {
  const MapSnapshot map = SnapshotOf(KnownByLearned(SavedMapOf(localizer_.map())), NewWorld(), 1);
  const ImageInput input = InputOf(pose_);
  SlamConfig config = SlamConfig::Offline();
  const MapLocalizer by_learned = MapLocalizer(map, config);
  for (const bool is_known : {true, false}) {
    const RelocalizationResult found =
        is_known ? by_learned.Relocalize(input, kByPoints)
                 : by_learned.Relocalize(input, {.mode = RelocalizationMode::kPoints});
    ASSERT_TRUE(found.world_from_cam) << found.why_not;
    EXPECT_LT(DistanceBetween(*found.world_from_cam, pose_), 0.02);
  }
  config.features.descriptor = DescriptorKind::kOrb;
  EXPECT_FALSE(MapLocalizer(map, config).Relocalize(input, kByPoints).world_from_cam);
}

TEST_F(MapLocalizerTest, WithoutAnImageDetectionsAreEnough) {
  ImageInput input;
  input.detections = DetectionsOf(*MapOf(localizer_.map()), pose_);
  const RelocalizationResult found = localizer_.Relocalize(input, {.camera = kWorldCamera});
  ASSERT_TRUE(found.world_from_cam) << found.why_not;
  EXPECT_EQ(found.evidence, PoseEvidence::kObjects);
  EXPECT_LT(DistanceBetween(*found.world_from_cam, pose_), 0.2);
}

TEST_F(MapLocalizerTest, TheCameraMayBeUnknown) {
  const RelocalizationResult found =
      localizer_.Relocalize(InputOf(pose_), {.mode = RelocalizationMode::kPoints});
  ASSERT_TRUE(found.world_from_cam) << found.why_not;
  ASSERT_TRUE(found.camera);
  EXPECT_NEAR(found.camera->fx, kWorldCamera.fx, 0.03 * kWorldCamera.fx);
}

TEST_F(MapLocalizerTest, AThreadAnswersAsManyDo) {
  ImageInput boxes;
  boxes.detections = DetectionsOf(*MapOf(localizer_.map()), pose_);
  const std::vector<ImageInput> inputs{InputOf(pose_), boxes, InputOf(BeforeTheWall(0, 0, 0))};
  const auto find = [&](size_t i) {
    return localizer_.Relocalize(inputs[i % inputs.size()], {.camera = kWorldCamera});
  };
  std::vector<RelocalizationResult> alone;
  for (size_t i = 0; i < inputs.size(); ++i) alone.push_back(find(i));
  const MapLocalizer copy = localizer_;
  EXPECT_EQ(copy.map().content()->index, localizer_.map().content()->index);
  std::vector<std::future<RelocalizationResult>> together;
  for (size_t i = 0; i < 4 * inputs.size(); ++i)
    together.push_back(std::async(std::launch::async, find, i));
  for (size_t i = 0; i < together.size(); ++i) {
    const RelocalizationResult found = together[i].get();
    const RelocalizationResult& expected = alone[i % inputs.size()];
    ASSERT_TRUE(found.world_from_cam && expected.world_from_cam);
    EXPECT_EQ(found.world_from_cam->translation, expected.world_from_cam->translation);
    EXPECT_EQ(found.world_from_cam->rotation.coeffs(), expected.world_from_cam->rotation.coeffs());
    EXPECT_EQ(found.inlier_points, expected.inlier_points);
    EXPECT_EQ(found.confidence, expected.confidence);
  }
}

TEST_F(MapLocalizerTest, InputsThatCannotBeUsedAreRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto problem = [&](const ImageInput& input, const Camera& camera = kWorldCamera,
                           const std::optional<Rigid3>& prior = std::nullopt) {
    return InputErrorOf([&] { localizer_.Relocalize(input, {.prior = prior, .camera = camera}); });
  };
  const ImageInput good = InputOf(pose_);
  Camera smaller = kWorldCamera;
  smaller.width = 320;
  EXPECT_THAT(problem(good, smaller), HasSubstr("image of 640x480 pixels"));
  Camera flat = kWorldCamera;
  flat.fx = 0;
  EXPECT_THAT(problem(good, flat), HasSubstr("focal length fx"));
  EXPECT_THAT(problem(good, Camera()), HasSubstr("camera: image width: 0"));
  ImageInput bad = good;
  bad.image.convertTo(bad.image, CV_32F);
  EXPECT_THAT(problem(bad), HasSubstr("8-bit"));
  bad = good;
  bad.gravity_in_cam = Eigen::Vector3d::Zero();
  EXPECT_THAT(problem(bad), HasSubstr("gravity"));
  bad = good;
  bad.angular_velocity = {{0.1, {0, 0, 0}}, {0.1, {0, 0, 0}}};
  EXPECT_THAT(problem(bad), HasSubstr("sample 1: angular velocity: time stamp 0.100000"));
  bad.angular_velocity = {{0.1, {0, kNan, 0}}};
  EXPECT_THAT(problem(bad), HasSubstr("sample 0: angular velocity: must be finite"));
  bad.timestamp = 7;
  bad.angular_velocity = {{7.9, {0, 0, 0}}, {8.1, {0, 0, 0}}};
  EXPECT_THAT(problem(bad), AllOf(HasSubstr("sample 1: angular velocity: time stamp 8.100000"),
                                  HasSubstr("at most 1 s later than the image's, 7.000000")));
  bad = good;
  bad.detections = {{.category_id = 1, .score = 0.5, .box = {0, 0, 10, kNan}}};
  EXPECT_THAT(problem(bad), HasSubstr("detection 0"));
  bad.image.release();
  EXPECT_THAT(problem(bad), HasSubstr("detection 0"));
  Rigid3 nowhere;
  nowhere.translation.x() = kNan;
  EXPECT_THAT(problem(good, kWorldCamera, nowhere), HasSubstr("pose"));
  EXPECT_INPUT_ERROR(localizer_.Relocalize({}),
                     HasSubstr("without an image the camera must be known"));
  EXPECT_INPUT_ERROR(localizer_.Relocalize(good, {.camera = kWorldCamera, .unknown_camera = true}),
                     HasSubstr("said to be unknown"));
  ImageInput boxes = good;
  boxes.image.release();
  EXPECT_INPUT_ERROR(localizer_.Relocalize(boxes, {.camera = kWorldCamera, .follow = true}),
                     HasSubstr("follows no film"));
}

}  // namespace
}  // namespace oaslam
