#include "oaslam/formats/unicode.h"

#include <gtest/gtest.h>

#include "temp_folder.h"

namespace oaslam {
namespace {

TEST(Unicode, ComposedIsOneFormForBoth) {
  EXPECT_EQ(Composed("Ku\xCC\x88"
                     "che.png"),
            "Küche.png");
  EXPECT_EQ(Composed("Küche.png"), "Küche.png");
  EXPECT_EQ(Composed("a b.png"), "a b.png");
  EXPECT_EQ(Composed("\xC3("), "\xC3(");  // no UTF-8
}

TEST(Unicode, FilesAreFoundInEitherForm) {
  const TempFolder folder;
  const std::string decomposed = folder.Write("Bu\xCC\x88ro/a\xCC\x88.png", "1");
  EXPECT_EQ(FileInEitherForm(folder / "Büro/ä.png"), decomposed);
  EXPECT_EQ(FileInEitherForm(decomposed), decomposed);
  EXPECT_EQ(FileInEitherForm(folder / "Büro/ö.png"), folder / "Büro/ö.png");
  // Two files of one name: neither is taken for a third spelling, the one that is named is found.
  const std::string one = folder.Write("\xE1\xBB\x87.png", "1"),
                    two = folder.Write("e\xCC\xA3\xCC\x82.png", "2");
  EXPECT_EQ(FileInEitherForm(one), one);
  EXPECT_EQ(FileInEitherForm(two), two);
  const std::string third = folder / "e\xCC\x82\xCC\xA3.png";
  EXPECT_EQ(FileInEitherForm(third), third);
}

}  // namespace
}  // namespace oaslam
