#include "oaslam/util/uri.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(Percent, TripletsAreDecoded) {
  EXPECT_EQ(DecodePercent("a%20flag/%C3%BC+%2f"), "a flag/\xC3\xBC+/");
  EXPECT_EQ(DecodePercent("%00"), std::string(1, '\0'));
  EXPECT_EQ(DecodePercent(""), "");
  for (const char* text : {"%", "%4", "a%4", "%zz", "%4g", "%-1", "%+1", "%0x", "% 1", "%%41"})
    EXPECT_FALSE(DecodePercent(text)) << text;
}

TEST(Percent, WhatIsEncodedComesBack) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all += static_cast<char>(byte);
  const std::string encoded = EncodeUriSegment(all);
  EXPECT_EQ(DecodePercent(encoded), all);
  EXPECT_EQ(encoded.find_first_of(" /?#+&"), std::string::npos);
  EXPECT_EQ(EncodeUriSegment("my chair-1.0_~"), "my%20chair-1.0_~");
}

}  // namespace
}  // namespace oaslam
