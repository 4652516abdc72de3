#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/camera_file.h"
#include "oaslam/detection_file.h"
#include "oaslam/image_source.h"
#include "oaslam/slam.h"
#include "temp_folder.h"

namespace oaslam {

// Images of the desk sample, and their detections separately.
struct Clip {
  explicit Clip(int from, int to)
      : camera(LoadCamera(kFolder + "/camera.yaml", {0, 0})),
        table(LoadDetections(kFolder + "/detections.json")) {
    const auto source = OpenImages(kFolder + "/video.mp4", {.from = from, .to = to});
    while (const auto image = source->Next()) {
      images.push_back({image->image.clone(), image->timestamp, {}, true});
      detections.push_back(
          table.Find(fmt::format("{:06}.jpg", from + static_cast<int>(detections.size()))));
    }
  }

  const std::string kFolder = std::string(OASLAM_SOURCE_DIR) + "/data/sample/map_front";
  Camera camera;
  DetectionTable table;
  std::vector<ImageInput> images;
  std::vector<std::vector<Detection>> detections;
};

// Tests with a map file of the desk.
class SlamWithMap : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new Shared;
    Slam slam(SlamConfig::Offline(), shared_->clip.camera);
    slam.SetClassNames({{1, "mine"}});
    slam.SetClassRelations(kRelations);
    for (size_t i = 0; i < 120; ++i) slam.Process(shared_->WithDetections(i));
    slam.Finish();
    slam.Save(Path());
  }
  static void TearDownTestSuite() { delete std::exchange(shared_, nullptr); }

  static const Clip& clip() { return shared_->clip; }
  static std::string Path() { return shared_->folder / "desk.map"; }
  static std::string Path(const std::string& name) { return shared_->folder / name; }
  // An image with its detections, without those of the category `except`.
  static ImageInput WithDetections(size_t i, int except = -1) {
    return shared_->WithDetections(i, except);
  }
  static ImageInput WithoutDetections(size_t i) {
    ImageInput input = clip().images[i];
    input.detections_follow = false;
    return input;
  }
  // Another place: its mirror image.
  static ImageInput Mirrored(size_t i) {
    ImageInput input = WithoutDetections(i);
    input.image = cv::Mat();  // whose pixels are the clip's
    cv::flip(clip().images[i].image, input.image, 1);
    return input;
  }
  static Slam MakeSlam() { return Slam(SlamConfig::Offline(), clip().camera); }

  inline static const ClassRelations kRelations{{{76, 66}}, {15}};
  inline static const RelocalizeOptions kByPoints{.mode = RelocalizationMode::kPoints};

 private:
  struct Shared {
    ImageInput WithDetections(size_t i, int except = -1) const {
      ImageInput input = clip.images[i];
      input.detections_follow = false;
      for (const Detection& d : clip.detections[i])
        if (d.category_id != except) input.detections.push_back(d);
      return input;
    }

    const Clip clip{0, 150};
    const TempFolder folder;
  };
  inline static Shared* shared_ = nullptr;
};

inline std::vector<Eigen::Vector3d> PlacesOf(const MapSnapshot& map) {
  std::vector<Eigen::Vector3d> places;
  for (const MapSnapshot::Landmark& landmark : map.Landmarks()) places.push_back(landmark.position);
  return places;
}

inline void ExpectSameMap(const MapSnapshot& a, const MapSnapshot& b) {
  const auto keyframes = a.Keyframes().ToVector(), others = b.Keyframes().ToVector();
  ASSERT_EQ(keyframes.size(), others.size());
  for (size_t i = 0; i < keyframes.size(); ++i)
    EXPECT_EQ(keyframes[i].world_from_cam.translation, others[i].world_from_cam.translation);
  EXPECT_EQ(PlacesOf(a), PlacesOf(b));
  const auto objects = a.Objects().ToVector(), other_objects = b.Objects().ToVector();
  ASSERT_EQ(objects.size(), other_objects.size());
  for (size_t i = 0; i < objects.size(); ++i)
    EXPECT_EQ(objects[i].ellipsoid.center, other_objects[i].ellipsoid.center);
}

}  // namespace oaslam
