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

// A text that has all of these in it.
template <typename... Texts>
auto HasSubstrs(const Texts&... texts) {
  return AllOf(HasSubstr(texts)...);
}

}  // namespace oaslam
