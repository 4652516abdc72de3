// An application may be compiled for another instruction set than the library, as with
// -march=native; both must agree on what public structures look like.
#include "layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

namespace oaslam {
namespace {

TEST(Layout, DoesNotDependOnTheInstructionSet) {
  EXPECT_TRUE(std::ranges::equal(kLayout, std::span(LayoutWithWideVectors(), std::size(kLayout))));
}

}  // namespace
}  // namespace oaslam
