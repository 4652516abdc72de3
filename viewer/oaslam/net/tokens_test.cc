#include "oaslam/net/tokens.h"

#include <filesystem>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

const std::string kReadToken = "reader-of-maps-1", kWriteToken = "Writer.of_maps~2";

struct TokensTest : FolderTest {};

TEST_F(TokensTest, AllowWhatTheirLinesSay) {
  const Tokens tokens = Tokens::Load(folder.Write(
      "tokens", "# who may do what\r\n\r\n  read " + kReadToken + "  # of the shop\r\n\twrite\t" +
                    kWriteToken + "\nread twice-mentioned-1\nwrite twice-mentioned-1\n" +
                    "read the-last-line-has-no-end"));
  EXPECT_EQ(tokens.AccessOf(kReadToken), Access::kRead);
  EXPECT_EQ(tokens.AccessOf(kWriteToken), Access::kWrite);
  EXPECT_EQ(tokens.AccessOf("twice-mentioned-1"), Access::kWrite);
  EXPECT_EQ(tokens.AccessOf("the-last-line-has-no-end"), Access::kRead);
  for (const std::string& other :
       {std::string(), kReadToken + "1", kReadToken.substr(1), " " + kReadToken,
        std::string("read"), std::string("READER-OF-MAPS-1"), std::string(100'000, 'x')})
    EXPECT_EQ(tokens.AccessOf(other), Access::kNone) << other.substr(0, 50);
}

TEST_F(TokensTest, FilesThatCannotBeUsedAreRefused) {
  const auto problem = [&](const std::string& content) {
    const std::string path = folder.Write("tokens", content);
    const std::string message = InputErrorOf([&] { Tokens::Load(path); });
    EXPECT_THAT(message, AllOf(HasSubstr(path + ":"), Not(HasSubstr("\n"))));
    return message;
  };
  EXPECT_THAT(problem(""), HasSubstr("has no token"));
  EXPECT_THAT(problem("# read " + kReadToken + "\n"), HasSubstr("has no token"));
  EXPECT_THAT(problem("read " + kReadToken + "\nadmin " + kWriteToken),
              HasSubstr(":2: \"admin\", expected: read TOKEN or write TOKEN"));
  EXPECT_THAT(problem("\n\nwrite"), HasSubstr(":3: expected one token after write"));
  EXPECT_THAT(problem("read " + kReadToken + " " + kWriteToken),
              HasSubstr(":1: expected one token"));
  EXPECT_THAT(problem("read 123456789-12345"),
              HasSubstr(":1: a token of 15 characters, needed: 16"));
  for (const char* token : {"with+a+plus-sign-", "with/slashes/in/it",
                            "with=signs=in=it=", "g\xC3\xBCnther-der-leser", "quoted-\"token\"-1"})
    EXPECT_THAT(problem(std::string("read ") + token),
                HasSubstr(":1: a token has letters, digits and -._~ only"))
        << token;
  EXPECT_INPUT_ERROR(Tokens::Load(folder / "missing"), HasSubstr("missing: cannot be read"));
  EXPECT_INPUT_ERROR(Tokens::Load(folder.path()), HasSubstr(folder.path()));
}

TEST_F(TokensTest, WarnWhereOtherUsersMayReadThem) {
  const std::string path = folder.Write("tokens", "read " + kReadToken);
  const auto warnings = [&](fs::perms permissions) {
    fs::permissions(path, permissions);
    std::vector<std::string> messages;
    SetLogSink([&](LogLevel level, const std::string& message) {
      if (level == LogLevel::kWarning) messages.push_back(message);
    });
    Tokens::Load(path);
    SetLogSink({});
    return messages;
  };
  using fs::perms;
  const perms own = perms::owner_read | perms::owner_write;
  EXPECT_THAT(warnings(own), IsEmpty());
  for (const perms others : {perms::group_read, perms::others_read})
    EXPECT_THAT(warnings(own | others), ElementsAre(HasSubstrs(path, "chmod 600")));
}

}  // namespace
}  // namespace oaslam
