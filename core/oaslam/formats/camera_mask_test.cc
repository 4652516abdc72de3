#include "oaslam/formats/camera_mask.h"

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

struct CameraMask : FolderTest {};

TEST_F(CameraMask, IsRelativeToTheCalibration) {
  EXPECT_EQ(MaskOfCalibration(folder.Write("a.yaml", "mask: hood.png\nwidth: 3\n")),
            folder / "hood.png");
  EXPECT_EQ(
      MaskOfCalibration(folder.Write("b.yaml", "cam0:\n  mask: /m/left.png\ncam1:\n  mask: x\n")),
      "/m/left.png");
  EXPECT_EQ(MaskOfCalibration(folder.Write("c.yaml", "width: 3\n")), "");
  EXPECT_EQ(MaskOfCalibration("fov:65"), "");
  EXPECT_EQ(MaskOfCalibration(folder / "missing.yaml"), "");
  EXPECT_INPUT_ERROR(MaskOfCalibration(folder.Write("d.yaml", "mask: [1, 2]\n")),
                     HasSubstrs("d.yaml", "mask", "path of an image"));
}

TEST_F(CameraMask, IsFoundInEachKindOfFile) {
  const std::pair<const char*, const char*> files[] = {
      {"orb.yaml", "%YAML:1.0\nCamera.fx: 500\nCamera.mask: m.png\n"},
      {"stella.yaml", "Camera:\n  fx: 500\n  mask: m.png\n"},
      {"okvis.yml", "cameras:\n  - {T_SC: [1], mask: m.png}\n"},
      {"transforms.json", "{\"fl_x\": 500, \"mask\": \"m.png\"}"},
      {"opencv.xml", "<?xml version=\"1.0\"?><opencv_storage><mask>m.png</mask></opencv_storage>"},
      {"calib.txt", "mask: m.png\nP0: 1\n"},
  };
  for (const auto& [name, text] : files)
    EXPECT_EQ(MaskOfCalibration(folder.Write(name, text)), folder / "m.png") << name;
}

// What they are is said by LoadCamera.
TEST_F(CameraMask, FilesThatAreNoMappingHaveNone) {
  for (const char* text : {"525 525 319.5 239.5\n", "600,0,639.5\n0,601,359.5\n0,0,1\n", "- a\n",
                           "1 PINHOLE 640 480 525 525 320 240\n", "a: [\n", ""})
    EXPECT_EQ(MaskOfCalibration(folder.Write("c.yaml", text)), "") << text;
}

}  // namespace
}  // namespace oaslam
