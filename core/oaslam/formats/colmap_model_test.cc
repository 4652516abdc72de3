#include "oaslam/formats/colmap_model.h"

#include <cstdint>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/camera_file.h"

namespace oaslam {
namespace {

template <typename T>
std::string BytesOfNumber(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

// A cameras.bin with a camera of this model and these parameters.
std::string BinaryCamera(uint32_t model, const std::vector<double>& parameters) {
  std::string bytes = BytesOfNumber<uint64_t>(1) + BytesOfNumber<uint32_t>(3) +
                      BytesOfNumber(model) + BytesOfNumber<uint64_t>(640) +
                      BytesOfNumber<uint64_t>(480);
  for (const double p : parameters) bytes += BytesOfNumber(p);
  return bytes;
}

struct ColmapModelTest : FolderTest {};

TEST_F(ColmapModelTest, BinaryCamerasAreThoseOfTheText) {
  const std::string binary =
      folder.Write("cameras.bin", BinaryCamera(4, {500, 510, 320, 240, 0.1, -0.02, 0.001, -0.002}));
  const std::string text =
      folder.Write("cameras.txt", "3 OPENCV 640 480 500 510 320 240 0.1 -0.02 0.001 -0.002\n");
  EXPECT_EQ(LoadCamera(binary, {}), LoadCamera(text, {}));
  folder.Write("cameras.bin", BinaryCamera(2, {500, 320, 240, 0.1}));
  EXPECT_EQ(LoadCamera(binary, {}).fy, 500);
}

TEST_F(ColmapModelTest, DamagedBinaryFilesAreNamed) {
  const std::string whole = BinaryCamera(1, {500, 500, 320, 240});
  for (size_t length = 0; length < whole.size(); length += 3) {
    const std::string path = folder.Write("cameras.bin", whole.substr(0, length));
    EXPECT_INPUT_ERROR(LoadCamera(path, {}), HasSubstr("cameras.bin: ends early"));
  }
  const std::string path = folder.Write("cameras.bin", BinaryCamera(99, {}));
  EXPECT_INPUT_ERROR(LoadCamera(path, {}), HasSubstr("camera 3 has model 99, allowed: 0 to 10"));
  // A number of points that would end beyond the file.
  std::string image = BytesOfNumber<uint64_t>(1) + BytesOfNumber<uint32_t>(1);
  for (const double x : {1, 0, 0, 0, 1, 2, 3}) image += BytesOfNumber(x);
  image += BytesOfNumber<uint32_t>(1) + std::string("a.png\0", 6);
  const std::string images =
      folder.Write("images.bin", image + BytesOfNumber<uint64_t>(~uint64_t{0}));
  EXPECT_INPUT_ERROR(LoadColmapPoses(images), HasSubstr("images.bin: ends early"));
  folder.Write("images.bin", image + BytesOfNumber<uint64_t>(0));
  ASSERT_EQ(LoadColmapPoses(images).size(), 1U);
  EXPECT_EQ(LoadColmapPoses(images)[0].name, "a.png");
}

TEST_F(ColmapModelTest, NamesMayHaveBlanks) {
  const auto poses = LoadColmapPoses(folder.Write(
      "images.txt", "1 1 0 0 0 1 2 3 1 left/my photo.jpg\n\n2 1 0 0 0 1 2 3 1 b.jpg\n"));
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].name, "left/my photo.jpg");
  EXPECT_EQ(poses[0].cam_from_world.translation, Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace oaslam
