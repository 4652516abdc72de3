#include "oaslam/storage/recordings.h"

#include "expect_input_error.h"
#include "oaslam/storage/map_file.h"
#include "random_map.h"

namespace oaslam {
namespace {

const MapRecordings kTwo{{"walk", "/a.mp4", 0}, {"walk \u00fc/2", "/b.mp4", 10}};

TEST(Recordings, AFrameTellsItsRecording) {
  EXPECT_EQ(RecordingOf({}, 7), 0U);
  EXPECT_EQ(RecordingOf(kTwo, -3), 0U);
  EXPECT_EQ(RecordingOf(kTwo, 9), 0U);
  EXPECT_EQ(RecordingOf(kTwo, 10), 1U);
  EXPECT_EQ(RecordingOf(kTwo, 1000), 1U);
}

TEST(Recordings, NamesOfFilesDifferAndAreWords) {
  EXPECT_EQ(FileNameOf({}, 0), "1");
  EXPECT_EQ(FileNameOf(kTwo, 0), "1-walk");
  EXPECT_EQ(FileNameOf(kTwo, 1), "2-walk____2");
  EXPECT_EQ(Describe({{"", "", 0}, {"b", "", 4}}), "1, 2 (b)");
}

TEST(Recordings, AreFoundByNumberOrName) {
  EXPECT_EQ(FindRecording({}, "1"), 0U);
  EXPECT_EQ(FindRecording(kTwo, "2"), 1U);
  EXPECT_EQ(FindRecording(kTwo, "walk"), 0U);
  EXPECT_INPUT_ERROR(FindRecording(kTwo, "3"), HasSubstrs("\"3\"", "1 (walk), 2 (walk"));
  EXPECT_INPUT_ERROR(FindRecording({{"a", "", 0}, {"a", "", 5}}, "a"), HasSubstr("several"));
}

TEST(Recordings, OneOfTwoIsTaken) {
  Rng rng(5);
  SavedMap saved = RandomMap({}, rng);
  const std::vector<KeyframeId> ids = saved.map.keyframes.Ids();
  const int middle = saved.map.keyframes.At(ids[ids.size() / 2]).frame_index;
  saved.recordings = {{"a", "", 0}, {"b", "", middle}};
  size_t total = 0;
  for (const size_t which : {0U, 1U}) {
    const SavedMap one = OfRecording(saved, which);
    EXPECT_EQ(one.recordings, MapRecordings{saved.recordings[which]});
    one.map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
      EXPECT_EQ(keyframe.frame_index >= middle, which == 1);
    });
    for (const FramePose& pose : one.trajectory) {
      EXPECT_EQ(pose.frame_index >= middle, which == 1);
      EXPECT_TRUE(one.map.ResolvePose(pose.reference) || !saved.map.ResolvePose(pose.reference));
    }
    EXPECT_THAT(one.map.CheckInvariants(), IsEmpty());
    total += one.map.keyframes.size();
  }
  EXPECT_EQ(total, saved.map.keyframes.size());
  saved.recordings.push_back({"c", "", 1'000'000});
  EXPECT_INPUT_ERROR(OfRecording(saved, 2), HasSubstr("3 (c) has no keyframe"));
}

}  // namespace
}  // namespace oaslam
