#include "oaslam/util/printable.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(Printable, TextStaysAsItIs) {
  for (const char* text :
       {"", "a.png: 5, allowed: 0 to 4", "Küche \u3042 \U0001F600", "two\nlines\t"})
    EXPECT_EQ(Printable(text), text);
}

TEST(Printable, WhatATerminalWouldObeyIsShown) {
  EXPECT_EQ(Printable("\x1b[31mred"), "\\x1b[31mred");
  EXPECT_EQ(Printable("\rover\x07\x7f"), "\\x0dover\\x07\\x7f");
  EXPECT_EQ(Printable("\u009b31m"), "\\xc2\\x9b31m");  // the same in one character
  EXPECT_EQ(Printable(std::string("\0a", 2)), "\\x00a");
}

TEST(Printable, BytesThatAreNoTextAreShown) {
  EXPECT_EQ(Printable("caf\xe9.png"), "caf\\xe9.png");
  EXPECT_EQ(Printable("\xff\xfe"), "\\xff\\xfe");
  EXPECT_EQ(Printable("cut \xe3\x81"), "cut \\xe3\\x81");
  EXPECT_EQ(Printable("\x80"), "\\x80");
}

}  // namespace
}  // namespace oaslam
