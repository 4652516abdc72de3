#include "oaslam/formats/text.h"

#include <filesystem>

#include "expect_input_error.h"
#include "full_disk.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

TEST(ReadTextFile, ADeviceWithoutEndIsRefused) {
  EXPECT_INPUT_ERROR(ReadTextFile("/dev/zero"), HasSubstr("larger than 1024 MiB"));
  EXPECT_EQ(ReadTextFile("/dev/null"), "");
}

TEST(WriteTextFile, AFullDiskLeavesTheOldFileWhole) {
  const TempFolder folder;
  WriteTextFile(folder / "a.txt", "old");
  WriteTextFile(folder / "a.txt", "older no more");
  EXPECT_EQ(folder.Read("a.txt"), "older no more");
  std::string error;
  {
    const FullDisk full(1000);
    error = InputErrorOf([&] { WriteTextFile(folder / "a.txt", std::string(100'000, 'x')); });
  }
  EXPECT_THAT(error, HasSubstr("cannot be written"));
  EXPECT_EQ(folder.Read("a.txt"), "older no more");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}),
            1);  // nothing is left beside it
  EXPECT_INPUT_ERROR(WriteTextFile(folder / "no/a.txt", "x"), HasSubstr("cannot be written"));
  EXPECT_INPUT_ERROR(WriteTextFile(folder.path(), "x"), HasSubstr("cannot be written"));
}

TEST(WriteTextFile, DevicesAndLinksStayWhatTheyAre) {
  const TempFolder folder;
  fs::create_symlink(folder.Write("target.txt", "a longer text"), folder / "link.txt");
  WriteTextFile(folder / "link.txt", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link.txt"));
  EXPECT_EQ(folder.Read("target.txt"), "new");
  WriteTextFile("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_INPUT_ERROR(WriteTextFile("/dev/full", "x"), HasSubstr("cannot be written"));
}

TEST(Text, MarksOfUnicodeAreLeftOut) {
  const TempFolder folder;
  const std::string text = "1.5 K\u00fcche/\u3042 \U0001F600.png\n";
  EXPECT_EQ(ReadTextFile(folder.Write("a.txt", text)), text);
  EXPECT_EQ(ReadTextFile(folder.Write("b.txt", "\xef\xbb\xbf" + text)), text);
  std::string little = "\xff\xfe", big = "\xfe\xff";
  for (const char16_t c : std::u16string(u"1.5 K\u00fcche/\u3042 \U0001F600.png\n")) {
    const char low = static_cast<char>(c & 0xFF), high = static_cast<char>(c >> 8);
    little += {low, high};
    big += {high, low};
  }
  EXPECT_EQ(ReadTextFile(folder.Write("c.txt", little)), text);
  EXPECT_EQ(ReadTextFile(folder.Write("d.txt", big)), text);
  EXPECT_EQ(ReadTextFile(folder.Write("e.txt", "\xff\xfe")), "");
  ReadTextFile(folder.Write("f.txt", std::string("\xff\xfe\x00\xd8x", 5)));  // cut and damaged
}

TEST(Text, WhatLooksLikeText) {
  EXPECT_TRUE(LooksLikeText("1.5 K\u00fcche.png\r\n\t"));
  EXPECT_TRUE(LooksLikeText("caf\xe9.png\n"));  // names in other encodings
  EXPECT_TRUE(
      LooksLikeText("\xff\xfe"
                    "1"));
  EXPECT_FALSE(LooksLikeText(std::string_view("a\0b", 3)));
  EXPECT_FALSE(LooksLikeText("\x1b[31m"));
  EXPECT_FALSE(LooksLikeText(std::string(10000, '\x80')));
}

TEST(Text, QuotedIsShortAndOnOneLine) {
  EXPECT_EQ(Quoted("a\tb"), "\"a b\"");
  EXPECT_EQ(Quoted("\x1b[31m"), "\"\\x1b[31m\"");
  EXPECT_EQ(Quoted(std::string(1000, 'x')).size(), 60);
}

}  // namespace
}  // namespace oaslam
