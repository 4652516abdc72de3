#include "oaslam/formats/camera_mask.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "expect_input_error.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(CameraMask, IsRelativeToTheCalibration) {
  const TempFolder folder;
  EXPECT_EQ(MaskOfCalibration(folder.Write("a.yaml", "mask: hood.png\nwidth: 3\n")),
            folder / "hood.png");
  EXPECT_EQ(
      MaskOfCalibration(folder.Write("b.yaml", "cam0:\n  mask: /m/left.png\ncam1:\n  mask: x\n")),
      "/m/left.png");
  EXPECT_EQ(MaskOfCalibration(folder.Write("c.yaml", "width: 3\n")), "");
  EXPECT_EQ(MaskOfCalibration("fov:65"), "");
  EXPECT_EQ(MaskOfCalibration(folder / "missing.yaml"), "");
  EXPECT_THAT(InputErrorOf([&] { MaskOfCalibration(folder.Write("d.yaml", "mask: [1, 2]\n")); }),
              AllOf(HasSubstr("d.yaml"), HasSubstr("mask"), HasSubstr("path of an image")));
}

}  // namespace
}  // namespace oaslam
