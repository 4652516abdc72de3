#include "oaslam/images/image_kinds.h"

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/log.h"

namespace oaslam {
namespace {

using NamesOfFolder = std::vector<std::string>;

NamesOfFolder Kept(NamesOfFolder names) {
  LeaveOutOtherKinds("d", true, names);
  return names;
}

TEST(ImageKinds, DepthAndMasksAreNoImages) {
  EXPECT_THAT(Kept({"conf_00000.png", "depth_00000.png", "frame_00000.jpg", "frame_00005.jpg"}),
              ElementsAre("frame_00000.jpg", "frame_00005.jpg"));
  EXPECT_THAT(Kept({"0001_depth.png", "0001_rgb.png", "0002_depth.png", "0002_rgb.png"}),
              ElementsAre("0001_rgb.png", "0002_rgb.png"));
  EXPECT_THAT(Kept({"IMG_7.JPG", "IMG_7.mask.png", "IMG_7-Normals.png", "IMG_8.JPG"}),
              ElementsAre("IMG_7.JPG", "IMG_8.JPG"));
}

TEST(ImageKinds, OtherFoldersAreWhatTheyAre) {
  for (const NamesOfFolder& names : {
           NamesOfFolder{"depth_1.png", "depth_2.png"},              // a film of depth images
           NamesOfFolder{"masked_ball_1.jpg", "masked_ball_2.jpg"},  // other words
           NamesOfFolder{"depth_3.png", "frame_1.png"},              // of other images
           NamesOfFolder{"mask.png", "photo.png"},                   // without numbers
       })
    EXPECT_EQ(Kept(names), names);
}

TEST(ImageKinds, WhatIsLeftOutIsSaid) {
  std::string said;
  SetLogSink([&](LogLevel, const std::string& message) { said += message; });
  NamesOfFolder names = {"a_1.png", "a_1_mask.png"};
  LeaveOutOtherKinds("d", false, names);
  EXPECT_THAT(said, HasSubstrs("d: 1 images", "a_1_mask.png"));
  said.clear();
  WarnOfSeries(
      "d", {"left_1.png", "left_2.png", "left_3.png", "right_1.png", "right_2.png", "right_3.png"});
  EXPECT_THAT(said, HasSubstrs("d: ", "left, right"));
  said.clear();
  WarnOfSeries("d", {"a_1.png", "a_2.png", "a_3.png", "b_4.png", "b_5.png", "b_6.png"});
  EXPECT_EQ(said, "");
  SetLogSink({});
}

}  // namespace
}  // namespace oaslam
