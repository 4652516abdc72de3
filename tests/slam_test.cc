// The public interface on the desk sample, used as by an application.

#include "oaslam/slam.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "oaslam/formats/camera_file.h"
#include "oaslam/formats/detection_file.h"
#include "oaslam/images/image_source.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr int kLag = 6;  // number of images by which the detector is late

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

// Processes a clip with a late detector; returns the total number of mapped objects seen.
int Follow(const Clip& clip, Slam& slam) {
  int seen = 0;
  std::vector<int> frames;
  for (size_t i = 0; i < clip.images.size(); ++i) {
    frames.push_back(slam.Process(clip.images[i]).frame);
    if (i >= kLag)
      seen += slam.AddDetections(frames[i - kLag], clip.detections[i - kLag]).value_or(0);
  }
  return seen;
}

TEST(Slam, AMapIsUsedAgainWithALateDetectorAndItsAnchors) {
  const Clip clip(0, 150);
  const TempFolder folder;
  Slam first(SlamConfig{}, clip.camera);
  ASSERT_GT(Follow(clip, first), 0);
  first.Finish();
  const MapSnapshot map = first.Snapshot();
  ASSERT_FALSE(map.objects.empty());
  const MapSnapshot::Object& object = map.objects.front();

  AnchorRequest request;
  request.model = "flag";
  request.object = object.id;
  request.origin = map.keyframes.back().translation;
  request.direction = object.ellipsoid.center - request.origin;
  ASSERT_EQ(first.PlaceAnchor(request).name, "flag 1");
  request.object = 99999;
  EXPECT_THAT(first.PlaceAnchor(request).why_not, HasSubstr("no object 99999"));
  EXPECT_THAT(first.EditAnchor("flag 1", {.name = "sign", .size = {}, .turn_rad = 0.1}), IsEmpty());
  EXPECT_THAT(first.EditAnchor("flag 1", {}), HasSubstr("no anchor"));
  ASSERT_THAT(first.Anchors(), SizeIs(1));
  const AnchorPose placed = first.Anchors().front();
  EXPECT_LT((placed.world_from_anchor.translation - object.ellipsoid.center).norm(),
            1.01 * object.ellipsoid.half_axes.maxCoeff());
  first.Save(folder / "desk.map");

  Slam second(SlamConfig{}, clip.camera);
  second.Load(folder / "desk.map");
  ASSERT_THAT(second.Anchors(), SizeIs(1));
  EXPECT_EQ(second.Anchors().front().name, "sign");
  EXPECT_LT((second.Anchors().front().world_from_anchor.translation -
             placed.world_from_anchor.translation)
                .norm(),
            1e-12);
  EXPECT_GT(Follow(Clip(200, 260), second), 60);  // each image shows several
  // The anchor moves with the object, whose ellipsoid is refined meanwhile.
  const auto objects = second.Snapshot().objects;
  const auto now = std::ranges::find(objects, object.id, &MapSnapshot::Object::id);
  ASSERT_NE(now, objects.end());
  EXPECT_LT((second.Anchors().front().world_from_anchor.translation - now->ellipsoid.center).norm(),
            1.2 * object.ellipsoid.half_axes.maxCoeff());
  EXPECT_TRUE(second.RemoveAnchor("sign"));
  EXPECT_FALSE(second.RemoveAnchor("sign"));
  EXPECT_THAT(second.Anchors(), IsEmpty());
}

}  // namespace
}  // namespace oaslam
