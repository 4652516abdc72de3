#include "oaslam/images/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/camera_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/image_list.h"
#include "oaslam/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// A folder as a dataset or recorder writes it, with three images.
struct MadeDataset {
  const char *layout, *images;  // tiny ones, with blanks between their paths
  std::vector<std::pair<const char*, std::string>> files;
  struct {
    double second_time;  // of the second image
    const char *camera, *imu;
    size_t truth;                     // the number of poses
    Eigen::Vector3d second_position;  // of the true poses
    double camera_fx = 0;             // 0: there is no camera
  } expected;
};

const std::string kTinyImage = "P5\n2 2\n255\nabcd";
const std::string kMatrices[] = {"1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n",
                                 "1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n", "-inf 0 0 0\n"};

// As the `count` bytes of a number in memory.
template <typename T>
std::string Bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

std::string ColmapCameras() {
  std::string bytes = Bytes<uint64_t>(1) + Bytes<uint32_t>(7) + Bytes<uint32_t>(1);
  bytes += Bytes<uint64_t>(640) + Bytes<uint64_t>(480);
  for (const double p : {500.0, 501.0, 320.0, 240.0}) bytes += Bytes(p);
  return bytes;
}

// Of the second and the first image, each turned by half a turn about x, with one point.
std::string ColmapImages() {
  std::string bytes = Bytes<uint64_t>(2);
  for (const int i : {2, 1}) {
    bytes += Bytes<uint32_t>(static_cast<uint32_t>(i));
    for (const double q : {0.0, 1.0, 0.0, 0.0}) bytes += Bytes(q);
    for (const double t : {-4.0, 5.0, 6.0}) bytes += Bytes(t);
    bytes += Bytes<uint32_t>(7) + "a" + std::to_string(i) + ".png" + std::string(1, '\0');
    bytes += Bytes<uint64_t>(1) + Bytes(1.0) + Bytes(2.0) + Bytes<uint64_t>(3);
  }
  return bytes;
}

// Of the image at a position, in the axes of ARKit.
std::string ScannerAppFile(double time, double focal_length, const std::string& position) {
  const std::vector<std::string> t = [&] {
    std::vector<std::string> fields;
    for (const std::string_view field : SplitFields(position))
      fields.emplace_back(field.substr(0, field.find(',')));
    return fields;
  }();
  return fmt::format(
      R"({{"cameraPoseARFrame": [1, 0, 0, {}, 0, 1, 0, {}, 0, 0, 1, {}, 0, 0, 0, 1],
          "intrinsics": [{}, 0, 320, 0, {}, 240, 0, 0, 1], "time": {}, "frame_index": 0}})",
      t[0], t[1], t[2], focal_length, focal_length, time);
}

// Of the image at (x, x + 1, x + 2).
std::string PolycamFile(double focal_length, int x) {
  return fmt::format(
      R"({{"fx": {}, "fy": {}, "cx": 320, "cy": 240, "width": 640, "height": 480,
          "t_00": 1, "t_01": 0, "t_02": 0, "t_03": {}, "t_10": 0, "t_11": 1, "t_12": 0,
          "t_13": {}, "t_20": 0, "t_21": 0, "t_22": 1, "t_23": {}, "blur_score": 100}})",
      focal_length, focal_length, x, x + 1, x + 2);
}

const MadeDataset kMadeDatasets[] = {
    {"EuRoC",
     "mav0/cam0/data/1.pgm mav0/cam0/data/2.pgm mav0/cam0/data/3.pgm",
     {{"mav0/cam0/data.csv",
       "#timestamp [ns],filename\n1403636579763555584,1.pgm\n1403636579813555456,2.pgm\n"
       "1403636579863555584,3.pgm\n"},
      {"mav0/cam0/sensor.yaml",
       "T_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, 0.5,\n   1, 0, 0, 0,\n   0, 0, 1, 0,\n   "
       "0, 0, 0, 1]\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458, 457, 367, "
       "248]\n"},
      {"mav0/imu0/data.csv", "#\n"},
      {"mav0/state_groundtruth_estimate0/data.csv",
       "#timestamp [ns],p_x,p_y,p_z,q_w,q_x,q_y,q_z,v\n1403636579763555584,0,0,0,1,0,0,0,9\n"
       "1403636579813555456,1,2,3,1,0,0,0,9\n"}},
     {1403636579.813555456, "mav0/cam0/sensor.yaml", "mav0/imu0/data.csv", 2, {1.5, 2, 3}, 458}},
    {"KITTI",
     "image_0/000000.pgm image_0/000001.pgm image_0/000002.pgm image_1/000000.pgm",
     {{"times.txt", "0.0\n1.036224e-01\n2.0e-01\n"},
      {"calib.txt", "P0: 718 0 607 0 0 718 185 0 0 0 1 0\n"},
      {"poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 4 0 1 0 5 0 0 1 6\n1 0 0 0 0 1 0 0 0 0 1 0\n"}},
     {0.1036224, "calib.txt", "", 3, {4, 5, 6}, 718}},
    {"7-Scenes",
     "frame-000000.color.png frame-000001.color.png frame-000002.color.png frame-000000.depth.png",
     {{"frame-000000.pose.txt", kMatrices[0]}, {"frame-000001.pose.txt", kMatrices[1]}},
     {1.0 / 30, "", "", 2, {4, 5, 6}}},
    {"ScanNet",
     "color/0.jpg color/1.jpg color/10.jpg depth/0.png",
     {{"intrinsic/intrinsic_color.txt", "1170 0 640 0\n0 1170 480 0\n0 0 1 0\n0 0 0 1\n"},
      {"pose/0.txt", kMatrices[0]},
      {"pose/1.txt", kMatrices[1]},
      {"pose/10.txt", kMatrices[2]}},
     {1.0 / 30, "intrinsic/intrinsic_color.txt", "", 2, {4, 5, 6}, 1170}},
    {"Record3D",
     "rgbd/0.jpg rgbd/1.jpg rgbd/2.jpg",
     {{"rgbd/0.depth", "x"},
      {"metadata",
       "{\"w\": 720, \"h\": 960, \"fps\": 60, \"K\": [700, 0, 0, 0, 701, 0, 360, 480, 1], "
       "\"poses\": [[0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 4, 5, 6], [0, 0, 0, 1, 0, 0, 0]]}"}},
     {1.0 / 60, "metadata", "", 3, {4, 5, 6}, 700}},
    {"Record3D",  // its export with depth in EXR files
     "rgb/0.jpg rgb/1.jpg rgb/2.jpg",
     {{"depth/0.exr", "x"},
      {"metadata.json",
       "{\"w\": 720, \"h\": 960, \"fps\": 60, \"K\": [700, 0, 0, 0, 701, 0, 360, 480, 1], "
       "\"poses\": [[0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 4, 5, 6], [0, 0, 0, 1, 0, 0, 0]]}"}},
     {1.0 / 60, "metadata.json", "", 3, {4, 5, 6}, 700}},
    {"Nerfstudio",
     "images/a1.png images/a2.png images/a10.png images/unused.png",
     {{"transforms.json",
       "{\"w\": 640, \"h\": 480, \"fl_x\": 500, \"frames\": [{\"file_path\": \"images/a10.png\"}, "
       "{\"file_path\": \"images/a1.png\"}, {\"file_path\": \"./images/a2\", \"transform_matrix\": "
       "[[1,0,0,4],[0,1,0,5],[0,0,1,6],[0,0,0,1]]}]}"}},
     {1.0 / 30, "transforms.json", "", 1, {4, 5, 6}, 500}},
    {"COLMAP",
     "images/a1.png images/a2.png images/a3.png",
     {{"sparse/0/cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n"},
      {"sparse/0/images.txt",
       "# head\n2 0 1 0 0 -4 5 6 1 a2.png\n1 2 3\n1 1 0 0 0 0 0 0 1 a1.png\n\n"}},
     {1.0 / 30, "sparse/0/cameras.txt", "", 2, {4, 5, 6}, 500}},
    {"COLMAP",
     "images/a1.png images/a2.png images/a3.png",
     {{"sparse/0/cameras.bin", ColmapCameras()}, {"sparse/0/images.bin", ColmapImages()}},
     {1.0 / 30, "sparse/0/cameras.bin", "", 2, {4, 5, 6}, 500}},
    {"COLMAP",  // as we export it
     "images/a1.png images/a2.png images/a3.png",
     {{"cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n"},
      {"images.txt", "2 0 1 0 0 -4 5 6 1 a2.png\n1 2 3\n1 1 0 0 0 0 0 0 1 a1.png\n\n"}},
     {1.0 / 30, "cameras.txt", "", 2, {4, 5, 6}, 500}},
    {"COLMAP",  // the images of two recordings
     "images/1/a1.png images/1/a2.png images/2/a1.png",
     {{"colmap/sparse/0/cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n"},
      {"colmap/sparse/0/images.txt",
       "2 0 1 0 0 -4 5 6 1 1/a2.png\n\n1 1 0 0 0 0 0 0 1 1/a1.png\n\n3 1 0 0 0 1 0 0 1 "
       "2/a1.png\n\n"}},
     {1.0 / 30, "colmap/sparse/0/cameras.txt", "", 3, {4, 5, 6}, 500}},
    {"Nerfstudio",  // an autofocus: a camera for each frame
     "images/0.png images/1.png images/2.png",
     {{"transforms.json",
       "{\"frames\": [{\"file_path\": \"images/0\", \"fl_x\": 502, \"fl_y\": 502, \"cx\": 320, "
       "\"cy\": 240, \"w\": 640, \"h\": 480}, {\"file_path\": \"images/1\", \"fl_x\": 498, \"w\": "
       "640, \"h\": 480, \"transform_matrix\": [[1,0,0,4],[0,1,0,5],[0,0,1,6],[0,0,0,1]]}, "
       "{\"file_path\": \"images/2\", \"fl_x\": 500, \"w\": 640, \"h\": 480}]}"}},
     {1.0 / 30, "transforms.json", "", 1, {4, 5, 6}, 500}},
    {"3D-Scanner-App",
     "frame_00000.jpg frame_00005.jpg frame_00010.jpg conf_00000.png depth_00000.png "
     "thumb_00000.jpg",
     {{"frame_00000.json", ScannerAppFile(10, 526, "1, 2, 3")},
      {"frame_00001.json", ScannerAppFile(10.1, 526, "1, 2, 3")},
      {"frame_00005.json", ScannerAppFile(10.5, 524, "4, 5, 6")},
      {"frame_00010.json", ScannerAppFile(11, 525, "7, 8, 9")}},
     {10.5, "frame_00010.json", "", 3, {4, 5, 6}, 525}},
    {"3D-Scanner-App",  // without times that a recording could have
     "frame_00000.jpg frame_00001.jpg frame_00002.jpg conf_00000.png",
     {{"frame_00000.json", ScannerAppFile(1, 526, "1, 2, 3")},
      {"frame_00001.json", ScannerAppFile(1, 525, "4, 5, 6")}},
     {1.0 / 30, "frame_00000.json", "", 2, {4, 5, 6}, 526}},
    {"Polycam",
     "keyframes/images/170000000000.jpg keyframes/images/170000300000.jpg "
     "keyframes/images/170000900000.jpg keyframes/depth/170000000000.png",
     {{"keyframes/cameras/170000000000.json", PolycamFile(525, 1)},
      {"keyframes/cameras/170000300000.json", PolycamFile(530, 4)},
      {"keyframes/cameras/170000900000.json", PolycamFile(520, 7)}},
     {170000.3, "keyframes/cameras/170000000000.json", "", 3, {4, 5, 6}, 525}},
    {"Polycam",  // after the loops were closed
     "keyframes/corrected_images/0.jpg keyframes/corrected_images/1.jpg "
     "keyframes/corrected_images/2.jpg keyframes/images/9.jpg",
     {{"keyframes/corrected_cameras/0.json", PolycamFile(525, 1)},
      {"keyframes/corrected_cameras/1.json", PolycamFile(525, 4)},
      {"keyframes/cameras/9.json", PolycamFile(400, 1)}},
     {1.0 / 30, "keyframes/corrected_cameras/1.json", "", 2, {4, 5, 6}, 525}},
    {"TUM",
     "rgb/a.png rgb/b.png rgb/c.png",
     {{"rgb.txt", "# color\n1.5 rgb/a.png\n1.6 rgb/b.png\n1.7 rgb/c.png\n"},
      {"groundtruth.txt", "1.5 1 2 3 0 0 0 1\n1.6 4 5 6 0 0 0 1\n"}},
     {1.6, "", "", 2, {4, 5, 6}}},
    {"ICL-NUIM",
     "rgb/0.png rgb/1.png rgb/2.png",
     {{"associations.txt", "0 depth/0.png 0 rgb/0.png\n"},
      {"livingRoom0.gt.freiburg", "0 1 2 3 0 0 0 1\n1 4 5 6 0 0 0 1\n7 4 5 6 0 0 0 1\n"}},
     {1.0 / 30, "", "", 2, {4, 5, 6}}},
};

void MakeDataset(const TempFolder& folder, const MadeDataset& made, const std::string& below = "") {
  for (const std::string_view image : SplitFields(made.images))
    folder.Write(below + std::string(image), kTinyImage);
  for (const auto& [name, text] : made.files) folder.Write(below + name, text);
}

const MadeDataset& MadeOf(const std::string& layout) {
  return *std::ranges::find(kMadeDatasets, layout, &MadeDataset::layout);
}

class EachDataset : public testing::TestWithParam<MadeDataset> {};

TEST_P(EachDataset, IsTakenByItself) {
  const MadeDataset& made = GetParam();
  const TempFolder folder;
  MakeDataset(folder, made);
  const auto found = FindDataset(folder.path(), {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->layout, made.layout);
  ASSERT_EQ(found->images.size(), 3U);
  EXPECT_NEAR(found->images[1].timestamp, made.expected.second_time, 1e-6);
  for (const ListedImage& image : found->images)
    EXPECT_TRUE(std::filesystem::exists(image.path)) << image.path;
  const auto path = [&](const std::string& name) {
    return name.empty() ? "" : folder.path() + "/" + name;
  };
  EXPECT_EQ(found->camera, path(made.expected.camera));
  EXPECT_EQ(found->imu, path(made.expected.imu));
  // The reader of images takes the same.
  const auto listed = ListImages(folder.path(), {});
  ASSERT_TRUE(listed);
  EXPECT_EQ(listed->size(), 3U);
  EXPECT_EQ((*listed)[1].timestamp, found->images[1].timestamp);
  EXPECT_EQ(NamesOfImages(folder.path(), {}).size(), 3U);
  // And so does its name, in any case, but no other.
  EXPECT_TRUE(FindDataset(folder.path(), {.dataset = Lower(made.layout)}));
  EXPECT_FALSE(FindDataset(folder.path(), {.dataset = "None"}));
  const std::string other = made.layout == std::string("KITTI") ? "tum" : "kitti";
  EXPECT_INPUT_ERROR(FindDataset(folder.path(), {.dataset = other}),
                     HasSubstrs(folder.path(), "--dataset " + other));
}

TEST_P(EachDataset, HasItsTruthAndItsCamera) {
  const MadeDataset& made = GetParam();
  const TempFolder folder;
  MakeDataset(folder, made);
  const auto found = FindDataset(folder.path(), {});
  ASSERT_TRUE(found && found->truth);
  const std::vector<StampedPose> truth = found->truth();
  ASSERT_EQ(truth.size(), made.expected.truth);
  const StampedPose& pose = truth[truth.size() > 1 ? 1 : 0];
  EXPECT_NEAR(pose.timestamp, made.expected.second_time, 1e-6);
  EXPECT_TRUE(pose.world_from_cam.translation.isApprox(made.expected.second_position));
  if (made.expected.camera_fx == 0) return;
  const bool has_no_size = made.layout == std::string("ScanNet") ||
                           made.layout == std::string("KITTI") ||
                           made.layout == std::string("3D-Scanner-App");
  const Camera camera = LoadCamera(found->camera, has_no_size ? cv::Size(1296, 968) : cv::Size());
  EXPECT_EQ(camera.fx, made.expected.camera_fx);
}

INSTANTIATE_TEST_SUITE_P(Layouts, EachDataset, testing::ValuesIn(kMadeDatasets),
                         [](const auto& test) {
                           std::string name = test.param.layout + std::to_string(test.index);
                           std::erase(name, '-');
                           name = "A" + name;  // one begins with a digit
                           return name;
                         });

struct DatasetTest : FolderTest {};

TEST_F(DatasetTest, CamerasOfOpenGlAreTurned) {
  for (const char* layout : {"Nerfstudio", "Record3D", "3D-Scanner-App", "Polycam"}) {
    const TempFolder dataset;
    MakeDataset(dataset, MadeOf(layout));
    const auto truth = FindDataset(dataset.path(), {})->truth();
    // They look along -z, and their y is up.
    EXPECT_TRUE((truth[0].world_from_cam.rotation * Eigen::Vector3d(0, 1, 2))
                    .isApprox(Eigen::Vector3d(0, -1, -2)))
        << layout;
  }
}

TEST_F(DatasetTest, TheBodyOfEuRoCIsNoCamera) {
  MakeDataset(folder, MadeOf("EuRoC"));
  const auto truth = FindDataset(folder.path() + "/mav0", {})->truth();
  EXPECT_TRUE((truth[1].world_from_cam.rotation * Eigen::Vector3d::UnitX())
                  .isApprox(Eigen::Vector3d::UnitY()));
}

TEST_F(DatasetTest, AFilmIsNamed) {
  folder.Write("rgb.mp4", "x");
  folder.Write("camera_matrix.csv", "1500, 0, 960\n0, 1500, 720\n0, 0, 1\n");
  folder.Write("odometry.csv",
               "timestamp, frame, x, y, z, qx, qy, qz, qw\n7.5, 000000, 1, 2, 3, 0, 0, 0, 1\n"
               "7.6, 000001, 1, 2, 4, 0, 0, 0, 1\n");
  const auto found = FindDataset(folder.path(), {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->layout, "Stray-Scanner");
  EXPECT_EQ(found->film, folder / "rgb.mp4");
  EXPECT_EQ(FilmOf(folder.path(), {}).path, folder / "rgb.mp4");
  EXPECT_THAT(FilmOf(folder.path(), {}).times,
              testing::Pointwise(testing::DoubleNear(1e-9), {0.0, 0.1}));
  EXPECT_EQ(FilmOf("a.mp4", {}).path, "a.mp4");
  EXPECT_EQ(LoadCamera(found->camera, {1920, 1440}).fx, 1500);
  const auto truth = found->truth();
  ASSERT_EQ(truth.size(), 2U);
  EXPECT_NEAR(truth[1].timestamp, 0.1, 1e-9);
  EXPECT_EQ(found->imu, "");
  // It is read as a film, which this one is not.
  EXPECT_FALSE(ListImages(folder.path(), {}));
  EXPECT_INPUT_ERROR(OpenImages(folder.path(), {}), HasSubstr("rgb.mp4"));
}

TEST_F(DatasetTest, ImusOfPhonesHaveTheirClock) {
  folder.Write("rgb.mp4", "x");
  folder.Write("camera_matrix.csv", "1500, 0, 960\n0, 1500, 720\n0, 0, 1\n");
  folder.Write("odometry.csv",
               "timestamp, frame, x, y, z, qx, qy, qz, qw\n7.5, 0, 1, 2, 3, 0, 0, 0, 1\n");
  folder.Write("imu.csv", "");
  const auto stray = FindDataset(folder.path(), {});
  ASSERT_TRUE(stray && stray->cam_from_imu);
  EXPECT_EQ(stray->imu, folder / "imu.csv");
  EXPECT_EQ(stray->imu_begin_s, 7.5);
  // Of a phone that is held for wide images, its right side up, what is up is up in the image.
  EXPECT_TRUE((stray->cam_from_imu->rotation * Eigen::Vector3d::UnitX())
                  .isApprox(-Eigen::Vector3d::UnitY()));
  // The screen looks at who holds it.
  EXPECT_TRUE((stray->cam_from_imu->rotation * Eigen::Vector3d::UnitZ())
                  .isApprox(-Eigen::Vector3d::UnitZ()));
  const TempFolder mars;
  mars.Write("movie.mp4", "x");
  mars.Write("gyro_accel.csv", "");
  EXPECT_EQ(FindDataset(mars.path(), {})->imu, "");
  mars.Write("frame_timestamps.txt",
             "Frame timestamp[nanosec],Unix time[nanosec]\n25000000000,17\n");
  const auto found = FindDataset(mars.path(), {});
  EXPECT_EQ(found->layout, "MARS-Logger");
  EXPECT_EQ(found->film, mars / "movie.mp4");
  EXPECT_EQ(found->imu, mars / "gyro_accel.csv");
  EXPECT_EQ(found->imu_begin_s, 25);
  EXPECT_FALSE(found->cam_from_imu);
}

TEST_F(DatasetTest, KittisPosesMayBeBesideItsSequences) {
  MakeDataset(folder, MadeOf("KITTI"), "sequences/07/");
  std::filesystem::create_directory(folder / "poses");
  std::filesystem::rename(folder / "sequences/07/poses.txt", folder / "poses/07.txt");
  for (const char* end : {"", "/"}) {
    const auto found = FindDataset(folder / ("sequences/07" + std::string(end)), {});
    ASSERT_TRUE(found && found->truth) << end;
    EXPECT_EQ(found->truth().size(), 3U);
  }
}

TEST_F(DatasetTest, TheRateThatIsGivenCounts) {
  for (const char* layout : {"KITTI", "Record3D", "COLMAP"}) {
    const TempFolder dataset;
    MakeDataset(dataset, MadeOf(layout));
    EXPECT_EQ(FindDataset(dataset.path(), {.fps = 4})->images[1].timestamp, 0.25) << layout;
    EXPECT_EQ(FindDataset(dataset.path(), {.fps = 4})->truth()[1].timestamp, 0.25) << layout;
  }
}

TEST_F(DatasetTest, OtherSourcesAreNone) {
  folder.Write("images/1.pgm", kTinyImage);
  folder.Write("1.pgm", kTinyImage);
  EXPECT_FALSE(FindDataset(folder.path(), {}));
  EXPECT_FALSE(FindDataset(folder / "1.pgm", {}));
  EXPECT_FALSE(FindDataset(folder / "missing", {}));
  EXPECT_FALSE(FindDataset(folder.path(), {.follow = FollowOptions{}}));
  EXPECT_INPUT_ERROR(FindDataset(folder.path(), {.dataset = "kiti"}),
                     HasSubstrs("--dataset kiti", "KITTI", "none"));
  EXPECT_INPUT_ERROR(FindDataset(folder / "1.pgm", {.dataset = "kitti"}),
                     HasSubstr("no folder in that layout"));
}

// What is wrong with a dataset after one of its files was replaced. `with_truth`: its poses are
// read.
std::string ProblemOf(const char* layout, const char* file, const std::string& text,
                      bool with_truth = false) {
  const TempFolder folder;
  MakeDataset(folder, MadeOf(layout));
  folder.Write(file, text);
  return InputErrorOf([&] {
    const auto found = FindDataset(folder.path(), {});
    if (with_truth) found->truth();
  });
}

TEST_F(DatasetTest, DamagedFilesAreNamed) {
  EXPECT_THAT(ProblemOf("KITTI", "times.txt", "0\n1\n"),
              HasSubstrs("times.txt: 2 times", "image_0 has 3 images", "KITTI; --dataset none"));
  EXPECT_THAT(ProblemOf("KITTI", "times.txt", "0\n1\nx\n"),
              HasSubstr("times.txt:3: column 1: expected a number"));
  EXPECT_THAT(ProblemOf("EuRoC", "mav0/cam0/data.csv", "#timestamp [ns],filename\n"),
              HasSubstrs("EuRoC", "no images"));
  EXPECT_THAT(ProblemOf("TUM", "rgb.txt", "1.5\n"), HasSubstr("rgb.txt:1"));
  EXPECT_THAT(ProblemOf("Nerfstudio", "transforms.json", "{\"frames\": [{}]}"),
              HasSubstr("transforms.json: frames[0]: key file_path"));
  EXPECT_THAT(ProblemOf("Nerfstudio", "transforms.json", "{\"frames\": 1}"),
              HasSubstr("key frames"));
  EXPECT_THAT(ProblemOf("Nerfstudio", "transforms.json", "{"), HasSubstr("no JSON object"));
  EXPECT_THAT(ProblemOf("Nerfstudio", "transforms.json", "{\"frames\": []}"),
              HasSubstr("no images"));
  EXPECT_THAT(
      ProblemOf("Nerfstudio", "transforms.json",
                "{\"frames\": [{\"file_path\": \"a\", \"transform_matrix\": [[1, 2], [3]]}]}"),
      HasSubstr("frames[0].transform_matrix: 3 numbers, expected 12"));
  EXPECT_THAT(ProblemOf("Record3D", "metadata", "x"), HasSubstr("metadata: is no JSON"));
  EXPECT_THAT(ProblemOf("Record3D", "metadata", "{\"fps\": -1}"), HasSubstr("fps: -1, allowed"));
  const TempFolder empty, scene;
  empty.Write("image_0/readme.txt", "none");
  empty.Write("times.txt", "0\n");
  EXPECT_INPUT_ERROR(FindDataset(empty.path(), {}),
                     HasSubstrs(empty.path(), "KITTI, but no images"));
  scene.Write("seq-01/frame-000000.color.png", kTinyImage);
  scene.Write("TrainSplit.txt", "sequence1\n");
  EXPECT_INPUT_ERROR(FindDataset(scene.path(), {}), HasSubstrs("one of its sequences", "seq-01"));
}

TEST_F(DatasetTest, DamagedPosesAreNamed) {
  EXPECT_THAT(ProblemOf("KITTI", "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n", true),
              HasSubstrs("poses.txt: 1 poses", "3 images"));
  EXPECT_THAT(ProblemOf("7-Scenes", "frame-000001.pose.txt", "1 0 0\n", true),
              HasSubstr("frame-000001.pose.txt:1: column 4"));
  EXPECT_THAT(ProblemOf("7-Scenes", "frame-000001.pose.txt", "1 0 0 1\n0 1 0 1\n", true),
              HasSubstr("8 numbers, expected a matrix"));
  EXPECT_THAT(ProblemOf("ScanNet", "pose/1.txt", "2 0 0 1\n0 1 0 1\n0 0 1 1\n", true),
              HasSubstrs("1.txt", "no rotation"));
  EXPECT_THAT(ProblemOf("Record3D", "metadata", "{\"poses\": [[0, 0, 0, 1, 1, 2, 3]]}", true),
              HasSubstrs("metadata: 1 poses", "3 images"));
  EXPECT_THAT(ProblemOf("COLMAP", "sparse/0/images.txt", "1 9 0 0 0 0 0 0 1 a\n", true),
              HasSubstr("images.txt:1: quaternion of length 9"));
  EXPECT_THAT(ProblemOf("COLMAP", "sparse/0/images.txt", "1 1 0 0 0 0 0 0 1\n", true),
              HasSubstr("images.txt:1: expected IMAGE_ID"));
}

// Poses without times are those of the images with the same names.
TEST_F(DatasetTest, ATruthWithoutTimesIsOfItsImages) {
  MakeDataset(folder, MadeOf("COLMAP"));
  const auto found = FindDataset(folder.path(), {});
  ASSERT_TRUE(found->named_truth);
  const auto poses = found->named_truth();
  const auto at = AtTimesOf({{7.5, "film/a2.jpg"}, {2.5, "film/a1.jpg"}, {3, "x.jpg"}}, poses, "p");
  ASSERT_EQ(at.size(), 2U);
  EXPECT_EQ(at[1].timestamp, 7.5);
  EXPECT_EQ(at[1].world_from_cam.translation, Eigen::Vector3d(4, 5, 6));
  EXPECT_INPUT_ERROR(AtTimesOf({{1, "000001.png"}}, poses, "p"),
                     HasSubstrs("p: none of its 2 images", "a2.png", "000001.png"));
  EXPECT_INPUT_ERROR(AtTimesOf({{1, "1/a1.png"}, {1, "2/a1.png"}}, poses, "p"),
                     HasSubstrs("p: two images", "1/a1.png and 2/a1.png"));
  // Times that are those of the recording need no names.
  for (const char* layout : {"EuRoC", "TUM", "KITTI", "Record3D", "Polycam"}) {
    const TempFolder other;
    MakeDataset(other, MadeOf(layout));
    EXPECT_FALSE(FindDataset(other.path(), {})->named_truth) << layout;
  }
}

TEST_F(DatasetTest, AModelWithoutItsImagesIsOnlyATruth) {
  folder.Write("cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n");
  folder.Write("images.txt", "2 1 0 0 0 0 0 0 1 0.433333.png\n\n");
  EXPECT_FALSE(FindDataset(folder.path(), {}));
  const auto found = FindTruth(folder.path(), {});
  ASSERT_TRUE(found && found->named_truth);
  EXPECT_EQ(found->named_truth().size(), 1U);
}

TEST_F(DatasetTest, AFocalLengthThatChangesIsSaid) {
  MakeDataset(folder, MadeOf("Polycam"));
  folder.Write("keyframes/cameras/170000900000.json", PolycamFile(1050, 7));
  std::string said;
  SetLogSink([&](LogLevel, const std::string& message) { said += message; });
  FindDataset(folder.path(), {});
  SetLogSink({});
  EXPECT_THAT(said, HasSubstrs("525.0 to 1050.0 px"));
}

TEST_F(DatasetTest, DamagedFilesOfPhonesAreNamed) {
  EXPECT_THAT(ProblemOf("3D-Scanner-App", "frame_00005.json", "{"),
              HasSubstrs("frame_00005.json: is no JSON object", "3D-Scanner-App; --dataset none"));
  EXPECT_THAT(ProblemOf("3D-Scanner-App", "frame_00005.json", "{\"intrinsics\": [1, 2]}"),
              HasSubstr("frame_00005.json: intrinsics: 2 numbers, expected 9"));
  EXPECT_THAT(ProblemOf("Polycam", "keyframes/cameras/170000300000.json",
                        "{\"t_00\": 5, \"t_01\": 0, \"t_02\": 0, \"t_03\": 0, \"t_10\": 0, "
                        "\"t_11\": 1, \"t_12\": 0, \"t_13\": 0, \"t_20\": 0, \"t_21\": 0, "
                        "\"t_22\": 1, \"t_23\": 0}",
                        true),
              HasSubstrs("170000300000.json", "no rotation"));
}

}  // namespace
}  // namespace oaslam
