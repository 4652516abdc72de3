#pragma once

#include <gtest/gtest.h>

#include "temp_folder.h"

namespace oaslam {

// The fixture of tests that work in a temporary folder, each in one of its own.
struct FolderTest : testing::Test {
  const TempFolder folder;
};

}  // namespace oaslam
