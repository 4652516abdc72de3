#include "oaslam/detection/model_folders.h"

#include <stdlib.h>

#include "expect_input_error.h"
#include "oaslam/detector.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

class ModelFoldersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("OASLAM_MODELS", ((folder_ / "a") + "::" + (folder_ / "b")).c_str(), 1);
    setenv("XDG_DATA_HOME", (folder_ / "data").c_str(), 1);
  }
  void TearDown() override {
    unsetenv("OASLAM_MODELS");
    unsetenv("XDG_DATA_HOME");
  }

  TempFolder folder_;
};

TEST(ModelName, IsNeitherAPathNorAnOption) {
  for (const char* name : {"yolox_nano", "a", "v8.1-small", "7"}) EXPECT_TRUE(IsModelName(name));
  for (const char* text : {"", "default", "none", "a/b", "a.onnx", "..", "-x", ".x", "a b", "\xe4"})
    EXPECT_FALSE(IsModelName(text)) << text;
}

TEST_F(ModelFoldersTest, AreLookedInOneAfterAnother) {
  const std::vector<std::filesystem::path> folders = ModelFolders();
  ASSERT_GE(folders.size(), 4u);
  EXPECT_EQ(folders[0], folder_ / "a");
  EXPECT_EQ(folders[1], folder_ / "b");
  EXPECT_EQ(folders[2], folder_ / "data/oaslam/models");
  EXPECT_EQ(folders.back(), "/usr/share/oaslam/models");
  EXPECT_FALSE(FindModel("own"));
  for (const char* name : {"data/oaslam/models/own.onnx", "b/own.onnx", "a/own.onnx"}) {
    const std::string path = folder_.Write(name, "");
    EXPECT_EQ(FindModel("own"), path);
    EXPECT_EQ(FindDetectorModel("own"), path);
  }
}

TEST_F(ModelFoldersTest, TheUsersFolderIsBelowHome) {
  setenv("XDG_DATA_HOME", "relative", 1);  // to be ignored
  const std::string home = getenv("HOME") != nullptr ? getenv("HOME") : "";
  setenv("HOME", "/home/a", 1);
  EXPECT_EQ(UserModelFolder(), "/home/a/.local/share/oaslam/models");
  unsetenv("HOME");
  EXPECT_FALSE(UserModelFolder());
  if (!home.empty()) setenv("HOME", home.c_str(), 1);
}

TEST_F(ModelFoldersTest, APathIsReturnedAsItIs) {
  for (const char* path : {"/nowhere/x.onnx", "x.onnx", "./x"})
    EXPECT_EQ(FindDetectorModel(path), path);
}

TEST_F(ModelFoldersTest, WhatIsNotThereIsRefusedWithThePlaces) {
  const std::string error = InputErrorOf([] { FindDetectorModel("museum"); });
  EXPECT_THAT(error, StartsWith("no detector museum: museum.onnx is in none of "));
  EXPECT_THAT(error, HasSubstr((folder_ / "b") + ", " + (folder_ / "data")));
  if (FindModel(kDefaultModel)) return;  // this machine has one for all users
  EXPECT_INPUT_ERROR(FindDetectorModel(), EndsWith("`oaslam models get yolox_nano` fetches it"));
}

}  // namespace
}  // namespace oaslam
