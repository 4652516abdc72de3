#include "oaslam/viewer/saved_run.h"

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/pictures/map_results.h"
#include "random_map.h"

namespace oaslam {
namespace {

constexpr const char* kObjects =
    R"([{"id": 3, "category_id": 41, "category": "mug", "center": [1, 2, 3], "half_axes": [0.1, 0.2, 0.1],
  "rotation": [0, 0, 0, 1], "observations": 50, "score": 0.9, "covariance_diag": [1, 1, 1, 1, 1, 1, 1]}])";
constexpr const char* kFrames =
    "frame,timestamp,state,keypoints,matched,inliers,detections,objects,ms_total,ms_features,ms_"
    "track,ms_objects,cpu_ms,filled\n"
    "100,0.000000,initializing,0,,,3,0,4.1,3,1,0,4,0\n"
    "101,0.033333,tracking,900,300,250,3,0,8.25,3,1,0,4,0\n";

struct SavedRunTest : FolderTest {};

TEST_F(SavedRunTest, AMapFile) {
  Rng rng(1);
  const SavedMap saved = RandomMap({}, rng);
  SaveMap(folder / "a.map", saved);
  const SavedRun run = LoadSavedRun(folder / "a.map", "");
  EXPECT_EQ(run.saved.map.landmarks.size(), saved.map.landmarks.size());
  EXPECT_THAT(run.notes, SizeIs(saved.trajectory.size()));
  EXPECT_EQ(LoadSavedRun(folder.path(), "").saved.map.landmarks.size(), saved.map.landmarks.size());
  folder.Write("frames.csv", kFrames);
  EXPECT_THAT(LoadSavedRun(folder.path(), "").notes, SizeIs(2));
  SaveMap(folder / "b.map", saved);
  EXPECT_INPUT_ERROR(LoadSavedRun(folder.path(), ""), HasSubstr("2 map files"));
  EXPECT_EQ(LoadSavedRun(folder.path(), folder / "b.map").map_file, folder / "b.map");
}

TEST_F(SavedRunTest, AFolderOfTextFiles) {
  folder.Write("objects.json", kObjects);
  folder.Write("trajectory.txt", "0.033333 1 2 3 0 0 0 1\n");
  folder.Write("keyframes.txt", "0.033333 1 2 3 0 0 0 1\n");
  folder.Write("frames.csv", kFrames);
  const SavedRun run = LoadSavedRun(folder.path(), "");
  EXPECT_EQ(run.map_file, "");
  EXPECT_EQ(run.saved.map.objects.At(ObjectId(3)).ellipsoid.center.y(), 2);
  EXPECT_EQ(run.saved.class_names.at(41), "mug");
  ASSERT_THAT(run.notes, SizeIs(2));
  EXPECT_EQ(run.notes[1].state, TrackingState::kTracking);
  EXPECT_EQ(run.notes[1].ms_total, 8.25);
  ASSERT_THAT(run.saved.trajectory, SizeIs(1));
  EXPECT_EQ(run.saved.trajectory[0].frame_index, 1);  // the second image that was processed
  const auto pose = run.saved.trajectory[0].cam_from_reference *
                    *run.saved.map.ResolvePose(run.saved.trajectory[0].reference);
  EXPECT_LT((pose.OriginInSource() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
}

TEST_F(SavedRunTest, PosesFoundInAMap) {
  Rng rng(1);
  SaveMap(folder / "a.map", RandomMap({}, rng));
  folder.Write("found/poses.txt", "0.5 7 8 9 0 0 0 1\n");
  folder.Write("found/frames.csv",
               "frame,timestamp,status,confidence,inlier_points,matched_objects,sigma_position,ms_"
               "features,ms\n5,0.5,points+objects,0.9,80,4,0.01,5,11\n");
  const SavedRun run = LoadSavedRun(folder / "found", folder / "a.map");
  ASSERT_THAT(run.saved.trajectory, SizeIs(1));
  EXPECT_EQ(run.saved.trajectory[0].state, TrackingState::kRelocalized);
}

TEST_F(SavedRunTest, BadInputIsNamed) {
  EXPECT_INPUT_ERROR(LoadSavedRun(folder.path(), ""), HasSubstr("neither a map file nor"));
  EXPECT_INPUT_ERROR(LoadSavedRun(folder.Write("x.map", "no map"), ""), HasSubstr("x.map"));
  const auto objects_error = [&](const std::string& text) {
    const TempFolder other;
    other.Write("objects.json", text);
    return InputErrorOf([&] { LoadSavedRun(other.path(), ""); });
  };
  EXPECT_THAT(objects_error("{"), HasSubstr("expected a JSON list"));
  EXPECT_THAT(objects_error("[1]"), HasSubstr("object 0"));
  EXPECT_THAT(
      objects_error(
          R"([{"id": 1, "category_id": 1, "center": [0, 0, null], "half_axes": [1, 1, 1], "rotation": [0, 0, 0, 1]}])"),
      HasSubstr("object 0"));
  EXPECT_THAT(
      objects_error(
          R"([{"id": 1, "category_id": 1, "center": [0, 0, 0], "half_axes": [1, 0, 1], "rotation": [0, 0, 0, 1]}])"),
      HasSubstr("half_axes"));
  EXPECT_THAT(
      objects_error(
          R"([{"id": 1, "category_id": 1, "center": [0, 0, 0], "half_axes": [1, 1, 1], "rotation": [0, 0, 0, 3]}])"),
      HasSubstr("rotation"));
  EXPECT_THAT(
      objects_error(
          R"([{"id": 4000000000, "category_id": 1, "center": [0, 0, 0], "half_axes": [1, 1, 1], "rotation": [0, 0, 0, 1]}])"),
      HasSubstr("id"));
  const auto frames_error = [&](const std::string& text) {
    const TempFolder other;
    other.Write("objects.json", kObjects);
    other.Write("frames.csv", text);
    return InputErrorOf([&] { LoadSavedRun(other.path(), ""); });
  };
  EXPECT_THAT(frames_error("frame,time\n"), HasSubstr("\"timestamp\" is missing"));
  EXPECT_THAT(frames_error("frame,timestamp,state,inliers,ms_total\n1,2,dreaming,4,5\n"),
              HasSubstr("frames.csv:2"));
  EXPECT_THAT(frames_error("frame,timestamp,state,inliers,ms_total\n1,2,lost,4\n"),
              HasSubstr("frames.csv:2"));
}

}  // namespace
}  // namespace oaslam
