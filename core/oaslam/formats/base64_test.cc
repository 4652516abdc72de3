#include "oaslam/formats/base64.h"

#include <gtest/gtest.h>

#include <utility>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

// RFC 4648, section 10.
const std::pair<std::string, std::string> kExamples[] = {
    {"", ""},
    {"f", "Zg=="},
    {"fo", "Zm8="},
    {"foo", "Zm9v"},
    {"foob", "Zm9vYg=="},
    {"fooba", "Zm9vYmE="},
    {"foobar", "Zm9vYmFy"},
};

TEST(Base64, EncodesAndDecodesTheExamplesOfTheStandard) {
  for (const auto& [bytes, text] : kExamples) {
    EXPECT_EQ(EncodeBase64(bytes), text);
    EXPECT_EQ(DecodeBase64(text), bytes);
  }
}

TEST(Base64, BytesOfAnyLengthComeBack) {
  Rng rng(1);
  for (size_t size : {1u, 2u, 3u, 255u, 65537u, 7u << 20}) {
    std::string bytes(size, '\0');
    for (char& byte : bytes) byte = static_cast<char>(rng.Index(256));
    const std::string text = EncodeBase64(bytes);
    EXPECT_EQ(text.size(), (size + 2) / 3 * 4);
    EXPECT_TRUE(DecodeBase64(text) == bytes) << size;
  }
}

TEST(Base64, OtherTextsAreRefused) {
  for (const char* text :
       {"Z", "Zg", "Zg=", "Zg==\n", " Zg==", "Zm9v\n", "Zm 9", "Zm9v====", "====", "=",
        "Z===", "Zg==Zg==", "Zm=v", "Zm-_", "Zh==", "Zm9=", "Zm9\xC3"})
    EXPECT_FALSE(DecodeBase64(text)) << text;
  EXPECT_FALSE(DecodeBase64(std::string_view("Zm\0v", 4)));
}

}  // namespace
}  // namespace oaslam
