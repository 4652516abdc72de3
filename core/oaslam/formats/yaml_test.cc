#include "oaslam/formats/yaml.h"

#include <fmt/format.h>
#include <unistd.h>

#include <functional>

#include "expect_input_error.h"
#include "oaslam/camera_file.h"
#include "oaslam/class_names.h"
#include "oaslam/config_file.h"

namespace oaslam {
namespace {

std::string Repeated(const std::string& what, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += what;
  return text;
}

TEST(Yaml, ANodeIsShownOnOneShortLine) {
  EXPECT_EQ(TextOfNode(YAML::Node("two\nlines\x7f")), "\"two lines\\x7f\"");
  EXPECT_EQ(TextOfNode(YAML::Load("[1, two]")), "[1, two]");
  EXPECT_EQ(TextOfNode(YAML::Load("a:")["a"]), "nothing");
  // 60 bytes with the quotes are shown as they are.
  const std::string longest = Repeated("x", 58);
  EXPECT_EQ(TextOfNode(YAML::Node(longest)), fmt::format("\"{}\"", longest));
  EXPECT_EQ(TextOfNode(YAML::Node(longest + "x")), fmt::format("\"{}...\"", Repeated("x", 55)));
  // The 55th byte is in the middle of a character, which is left out.
  EXPECT_EQ(TextOfNode(YAML::Node(Repeated("\u00e4", 500000))),
            fmt::format("\"{}...\"", Repeated("\u00e4", 27)));
  EXPECT_EQ(TextOfNode(YAML::Load(fmt::format("[{}1]", Repeated("1, ", 100)))).size(), 60);
}

TEST(Yaml, CommentsAloneAreAnEmptyMapping) {
  for (const char* text : {"", "\n", "# nothing\n", "%YAML:1.0\n---\n# nothing\n"}) {
    const YAML::Node root = ParseYamlMapping(text, "c.yaml");
    EXPECT_TRUE(root.IsMap()) << text;
    EXPECT_EQ(root.size(), 0) << text;
  }
  EXPECT_INPUT_ERROR(ParseYamlMapping("- a\n", "c.yaml"), HasSubstr("c.yaml"));
}

TEST(Yaml, NumbersNeedOnlyBeFinite) {
  const auto numbers = [](const char* text) { return YamlNumbers(YAML::Load(text), "c", "k"); };
  EXPECT_THAT(numbers("[1e200, -1e200]"), ElementsAre(1e200, -1e200));
  EXPECT_EQ(YamlNumber(YAML::Load("-1e200"), "c", "k"), -1e200);
  for (const char* text : {"[1, 1e999]", "[1, .inf]", "[1, .nan]"})
    EXPECT_INPUT_ERROR(numbers(text), HasSubstrs("k[1]", "expected a number")) << text;
}

// What `read` makes of the text from a pipe, such as `--config <(...)` gives: it can be read once.
void WithPipe(const std::string& text, const std::function<void(const std::string&)>& read) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  close(ends[1]);
  read(fmt::format("/dev/fd/{}", ends[0]));
  close(ends[0]);
}

TEST(Yaml, FilesAreReadOnce) {
  SlamConfig config = SlamConfig::Offline();
  WithPipe("tracking: {min_inliers: 20}\n",
           [&](const std::string& path) { LoadConfig(path, config); });
  EXPECT_EQ(config.tracking.min_inliers, 20);
  Camera camera;
  WithPipe("resolution: [752, 480]\nintrinsics: [458.6, 457.3, 367.2, 248.4]\n",
           [&](const std::string& path) { camera = LoadCamera(path, {}); });
  EXPECT_EQ(camera.fx, 458.6);
  Classes classes;
  WithPipe("names: [bird, stone]\n", [&](const std::string& path) { classes = LoadClasses(path); });
  EXPECT_EQ(NameOf(classes.names, 1), "stone");
}

}  // namespace
}  // namespace oaslam
