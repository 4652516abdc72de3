#include "oaslam/images/video_container.h"

#include "matchers.h"

namespace oaslam {
namespace {

using testing::Pointwise;

TEST(SpreadEqualTimes, UpToTheNextOne) {
  std::vector<double> times{0, 1, 1, 1, 4, 5, 5};
  EXPECT_EQ(SpreadEqualTimes(times), 3);
  EXPECT_THAT(times, Pointwise(DoubleNear(1e-12), {0., 1., 2., 3., 4., 5., 6.}));
  EXPECT_EQ(SpreadEqualTimes(times), 0);
}

TEST(TimeIndexOf, BelievesTheDecoderOnlyWhereTheContainerAgrees) {
  VideoTimes times{.seconds = {0, 0.03, 0.07, 0.2}, .start = -0.1};
  EXPECT_EQ(TimeIndexOf(times, 0, -0.1), 0u);
  EXPECT_EQ(TimeIndexOf(times, 1, -0.03), 2u);  // one was not decoded
  EXPECT_EQ(TimeIndexOf(times, 1, 0), 1u);      // no time of the container
  EXPECT_EQ(TimeIndexOf(times, 2, -0.1), 2u);   // past
  EXPECT_EQ(TimeIndexOf(times, 4, 0.1), 4u);    // one too many
}

}  // namespace
}  // namespace oaslam
