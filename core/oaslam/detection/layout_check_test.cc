#include "oaslam/detection/layout_check.h"

#include <gmock/gmock.h>

namespace oaslam {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

const cv::Size kInput(640, 640);

// What the check says of rows of one output after another.
class Rows {
 public:
  Rows(DetectorLayout layout, int columns, int classes, int rows = 300)
      : format_{layout, classes}, shape_{1, rows, columns} {}

  std::string Add(const std::vector<float>& row) {
    cv::Mat tensor(shape_, CV_32F, cv::Scalar(0));
    std::ranges::copy(row, tensor.ptr<float>());
    return check_.Add(tensor, format_, kInput, DecodeCandidates(tensor, format_, kInput, 0.2));
  }

 private:
  OutputFormat format_;
  std::vector<int> shape_;
  LayoutCheck check_;
};

Rows Listed() { return {DetectorLayout::kEndToEnd, 6, 80}; }
const std::vector<float> kGood{10, 20, 90, 200, 0.9F, 41};

TEST(LayoutCheck, AScoreOutsideZeroToOneIsRefusedInEveryImage) {
  Rows rows = Listed();
  for (int i = 0; i < 30; ++i) ASSERT_THAT(rows.Add(kGood), IsEmpty());
  EXPECT_THAT(rows.Add({10, 20, 90, 200, 1.005F, 41}), IsEmpty());  // of a network of 8 bits
  EXPECT_THAT(rows.Add({10, 20, 90, 200, 41, 0.9F}), HasSubstr("a score of 41, allowed: 0 to 1"));
}

// Angles and keypoints behind the classes are below the least score where no object is.
TEST(LayoutCheck, ScoresCountWithoutABox) {
  Rows dense(DetectorLayout::kYolov5, 8, 3);
  EXPECT_THAT(dense.Add({250, 300, 100, 80, 0.01F, 0, 0, -0.4F}), HasSubstr("a score of -0.4"));
  Rows listed = Listed();
  EXPECT_THAT(listed.Add({-1, -1, -1, -1, -1, -1}), IsEmpty());  // fills the list up
}

TEST(LayoutCheck, BoxesThatAreNoneAreRefusedUnlessTheyAreFew) {
  const std::vector<std::vector<float>> bad{
      {0.3F, 0.4F, 0.5F, 0.6F, 0.9F, 41},  // shares of the image
      {250, 300, 100, 80, 0.9F, 41},       // centre and size
      {2500, 300, 2600, 380, 0.9F, 41},    // outside
      {10, 20, 90, 200, 0.9F, 2.7F},       // no class
      {10, 20, 90, 200, 0.9F, 80},         // a class without a name
      {0, 0, 0, 0, 0.9F, 41},              // empty
  };
  for (const std::vector<float>& row : bad) {
    EXPECT_THAT(Listed().Add(row), HasSubstr("1 of 1 boxes of the first images outside"));
    Rows rows = Listed();
    EXPECT_THAT(rows.Add(kGood), IsEmpty());
    EXPECT_THAT(rows.Add(row), IsEmpty());
    EXPECT_THAT(rows.Add(row), HasSubstr("2 of 3"));
    Rows later = Listed();
    for (int i = 0; i < 10; ++i) EXPECT_THAT(later.Add(kGood), IsEmpty());
    for (int i = 0; i < 30; ++i) EXPECT_THAT(later.Add(row), IsEmpty());
  }
}

TEST(LayoutCheck, YoloxIsNotDecoded) {
  Rows rows(DetectorLayout::kYolox, 85, 80, 8400);
  EXPECT_THAT(rows.Add({-1.5F, 4, 1, 1}), IsEmpty());
  EXPECT_THAT(rows.Add({250, 300, 100, 80, 0.01F}), HasSubstr("a centre 300 cells from its own"));
}

}  // namespace
}  // namespace oaslam
