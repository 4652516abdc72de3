#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <bit>
#include <stdexcept>

#include "expect_input_error.h"
#include "oaslam/map/renumbering.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/storage/map_schema.h"
#include "random_map.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

// As SQLite stores a number.
std::string StoredNumber(double value) {
  const auto bits = std::bit_cast<uint64_t>(value);
  std::string bytes;
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(bits >> shift);
  return bytes;
}

std::string BytesOf(const Descriptor& descriptor) {
  return {reinterpret_cast<const char*>(descriptor.data()), sizeof descriptor};
}

// The file with a bit changed in the first place that has these bytes; submaps come last.
std::string WithBitFlippedIn(std::string file, const std::string& bytes) {
  const size_t place = file.find(bytes);
  if (place == std::string::npos) throw std::logic_error("no such bytes in the file");
  file[place + bytes.size() - 1] ^= 2;
  return file;
}

// A map of three parts of keyframes and two of landmarks, with an anchor and a submap.
class MapPartsTest : public testing::Test {
 protected:
  MapPartsTest() {
    Rng rng(4);
    saved_ = RandomMap({.keyframes = 140, .keypoints = 120, .landmarks = 5000, .views = 3}, rng);
    Anchor& anchor = saved_.map.anchors["a flag"];
    anchor.size = 0.12345;
    anchor.keyframe = saved_.map.keyframes.Ids().front();
    const SavedMap other = RandomMap({}, rng);
    saved_.submaps.push_back(
        Renumbered({other.map, other.trajectory}, {.first = NextIdsOf(saved_.map),
                                                   .first_frame = FramesOf(saved_),
                                                   .cameras = saved_.map.cameras,
                                                   .camera_of = {0, 1}}));
    SaveMap(Path(), saved_);
    content_ = folder_.Read("a.map");
  }

  std::string Path() const { return folder_ / "a.map"; }

  std::string ErrorWith(const std::string& content) const {
    folder_.Write("a.map", content);
    const std::string error = InputErrorOf([&] { LoadMap(Path()); });
    EXPECT_THAT(error, AllOf(HasSubstr("a.map: is damaged"), Not(HasSubstr("\n"))));
    return error;
  }

  const Keyframe& KeyframeAt(size_t i) const {
    return saved_.map.keyframes.At(saved_.map.keyframes.Ids()[i]);
  }
  const Landmark& LandmarkAt(size_t i) const {
    return saved_.map.landmarks.At(saved_.map.landmarks.Ids()[i]);
  }
  std::string KeyframesOfPart(size_t first, size_t last) const {
    const std::vector<KeyframeId> ids = saved_.map.keyframes.Ids();
    return fmt::format("keyframes {} to {}: ", ids[first].value, ids[last].value);
  }
  std::string LandmarksOfPart(size_t first, size_t last) const {
    const std::vector<LandmarkId> ids = saved_.map.landmarks.Ids();
    return fmt::format("landmarks {} to {}: ", ids[first].value, ids[last].value);
  }

  TempFolder folder_;
  SavedMap saved_;
  std::string content_;
};

TEST_F(MapPartsTest, AllPartsAreRead) {
  const SavedMap loaded = LoadMap(Path());
  EXPECT_EQ(loaded.map.keyframes.Ids(), saved_.map.keyframes.Ids());
  EXPECT_EQ(loaded.map.landmarks.Ids(), saved_.map.landmarks.Ids());
  SaveMap(folder_ / "b.map", loaded);
  EXPECT_TRUE(folder_.Read("b.map") == content_);
}

TEST_F(MapPartsTest, AFlippedBitIsToldWithItsPart) {
  const size_t keyframes = saved_.map.keyframes.size(), landmarks = saved_.map.landmarks.size();
  const Object& object = saved_.map.objects.At(saved_.map.objects.Ids().back());
  const Map& submap = saved_.submaps[0].map;
  const std::vector<std::pair<std::string, std::string>> places = {
      {StoredNumber(saved_.map.cameras[0].fx), "cameras: "},
      {StoredNumber(KeyframeAt(3).cam_from_world.translation.x()), KeyframesOfPart(0, 63)},
      {BytesOf(KeyframeAt(70).features->descriptors[5]), KeyframesOfPart(64, 127)},
      {StoredNumber(KeyframeAt(130).cam_from_world.translation.z()),
       KeyframesOfPart(128, keyframes - 1)},
      {StoredNumber(LandmarkAt(10).position.x()), LandmarksOfPart(0, 4095)},
      {StoredNumber(LandmarkAt(4500).normal.y()), LandmarksOfPart(4096, landmarks - 1)},
      {StoredNumber(
           saved_.map.retired.At(saved_.map.retired.First()).cam_from_parent.translation.x()),
       "retired keyframes: "},
      {StoredNumber(object.ellipsoid.center.x()), "objects: "},
      {StoredNumber(object.observations[2].cam_from_reference.translation.y()), "objects: "},
      {StoredNumber(saved_.trajectory[7].cam_from_reference.translation.x()), "trajectory: "},
      {"chair", "class names: "},
      {StoredNumber(0.12345), "anchors: "},
      {StoredNumber(submap.landmarks.At(submap.landmarks.First()).position.x()),
       "submap 1: is damaged in 1 of its"},
      {StoredNumber(saved_.map.up->x()), "list of its parts: "}};
  for (const auto& [bytes, part] : places) {
    const std::string error = ErrorWith(WithBitFlippedIn(content_, bytes));
    EXPECT_THAT(error, HasSubstr(part));
    if (part != "list of its parts: ") {
      EXPECT_THAT(error, HasSubstr("is damaged in 1 of its 13 parts"));
    }
  }
}

TEST_F(MapPartsTest, AllDamagedPartsAreToldTogether) {
  std::string damaged =
      WithBitFlippedIn(content_, StoredNumber(KeyframeAt(3).cam_from_world.translation.x()));
  damaged = WithBitFlippedIn(damaged, StoredNumber(LandmarkAt(4500).position.z()));
  EXPECT_THAT(ErrorWith(damaged),
              HasSubstrs("in 2 of its 13 parts", KeyframesOfPart(0, 63),
                         LandmarksOfPart(4096, saved_.map.landmarks.size() - 1)));
}

TEST_F(MapPartsTest, ASubmapIsReadWithoutTheOthers) {
  const Map& submap = saved_.submaps[0].map;
  folder_.Write(
      "a.map",
      WithBitFlippedIn(content_,
                       StoredNumber(submap.landmarks.At(submap.landmarks.First()).position.x())));
  EXPECT_EQ(LoadSubmap(Path(), 0).map.landmarks.size(), saved_.map.landmarks.size());
  EXPECT_INPUT_ERROR(LoadSubmap(Path(), 1), HasSubstr("submap 1"));
  folder_.Write("a.map", WithBitFlippedIn(content_, StoredNumber(LandmarkAt(10).position.x())));
  const SavedMap loaded = LoadSubmap(Path(), 1);
  EXPECT_EQ(loaded.map.landmarks.size(), submap.landmarks.size());
  EXPECT_EQ(loaded.class_names, saved_.class_names);
  EXPECT_INPUT_ERROR(LoadSubmap(Path(), 0), HasSubstr(LandmarksOfPart(0, 4095)));
}

// Rows that are there, or not, contrary to the list of parts.
TEST_F(MapPartsTest, TheListOfPartsIsComplete) {
  for (const char* change :
       {"DELETE FROM parts WHERE name = 'objects'", "DELETE FROM parts WHERE first > 0",
        "UPDATE parts SET last = last + 1 WHERE name = 'keyframes'",
        "INSERT INTO parts VALUES('landmarks', 7, 9, '')",
        "UPDATE parts SET name = 'others' WHERE name = 'anchors'", "DROP TABLE parts",
        "DELETE FROM landmarks WHERE id = 7", "DELETE FROM features WHERE keyframe = 0",
        "INSERT INTO covisibility VALUES(0, 1000, 2, 3)"}) {
    folder_.Write("a.map", content_);
    SQLite::Database(Path(), SQLite::OPEN_READWRITE).exec(change);
    EXPECT_INPUT_ERROR(LoadMap(Path()), HasSubstr("is damaged")) << change;
  }
}

}  // namespace
}  // namespace oaslam
