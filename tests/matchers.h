#pragma once

#include <gmock/gmock.h>

namespace oaslam {

// GoogleTest with the matchers that most tests use, by their own names.
using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;
using ::testing::SizeIs;
using ::testing::StartsWith;

}  // namespace oaslam
