// The rooms of src/CMakeLists.txt and the arrows between them: who may include whom. The build
// alone cannot tell, because all rooms share one include folder.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace oaslam {
namespace {

using Rooms = std::map<std::string, std::set<std::string>>;

std::string TextOf(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::set<std::string> AllMatches(const std::string& text, const std::regex& pattern) {
  std::set<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it)
    found.insert((*it)[1]);
  return found;
}

// The rooms that the build links; a room may also include what those it names may.
Rooms RoomsOfBuild(const std::string& cmake) {
  static const std::regex call(R"(oaslam_room\((\w+)([^)]*)\))"), link(R"(oaslam_(\w+))");
  Rooms rooms;
  for (std::sregex_iterator it(cmake.begin(), cmake.end(), call), end; it != end; ++it)
    rooms[(*it)[1]] = AllMatches((*it)[2], link);
  return rooms;
}

// The rows `room` | what it holds | the rooms that it may enter.
Rooms RoomsOfPage(const std::string& page) {
  static const std::regex row(R"(^\| `(\w+)` \|.*\|([^|]*)\|$)"), room(R"(`(\w+)`)");
  Rooms rooms;
  std::istringstream lines(page);
  std::smatch match;
  for (std::string line; std::getline(lines, line);)
    if (std::regex_search(line, match, row)) rooms[match[1]] = AllMatches(match[2], room);
  return rooms;
}

const Rooms& Architecture() {
  static const Rooms rooms =
      RoomsOfBuild(TextOf(std::filesystem::path(OASLAM_SOURCE_DIR) / "src" / "CMakeLists.txt"));
  return rooms;
}

// The rooms that implement public headers, those with a file of the same name: only they and those
// above them may use these. What is not listed is for all.
const std::map<std::string, std::string>& ImplementedIn() {
  static const std::map<std::string, std::string> owners = [] {
    const std::filesystem::path root = OASLAM_SOURCE_DIR;
    std::map<std::string, std::string> found;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(root / "src" / "oaslam")) {
      const std::string header = entry.path().stem().string() + ".h";
      if (entry.path().extension() == ".cc" &&
          std::filesystem::exists(root / "include" / "oaslam" / header))
        found[header] = entry.path().parent_path().filename();
    }
    return found;
  }();
  return owners;
}

std::set<std::string> Closure(const Rooms& rooms, const std::string& room) {
  std::set<std::string> reached{room};
  std::vector<std::string> open{room};
  while (!open.empty()) {
    const std::string next = open.back();
    open.pop_back();
    for (const std::string& below : rooms.at(next))
      if (reached.insert(below).second) open.push_back(below);
  }
  return reached;
}

struct SourceFile {
  std::string path;  // "tracking/motion_model.cc"; of a public header "public/slam.h"
  std::string text;
};

std::vector<std::string> IncludesOf(const std::string& text) {
  static const std::regex include(R"re(^[ \t]*#[ \t]*include[ \t]*["<]([^">]+)[">])re");
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::smatch match;
  for (std::string line; std::getline(lines, line);)
    if (std::regex_search(line, match, include)) found.push_back(match[1]);
  return found;
}

bool IsQuoted(const std::string& text, const std::string& include) {
  return text.find("#include \"" + include + '"') != std::string::npos;
}

// The problem of one include; empty if there is none.
std::string Problem(const Rooms& rooms, const SourceFile& file, const std::string& include) {
  const std::string room = file.path.substr(0, file.path.find('/'));
  const bool is_test = file.path.ends_with("_test.cc");
  if (!include.starts_with("oaslam/")) {
    // Helpers of tests are in tests/; all other files of ours are included by their full paths.
    return IsQuoted(file.text, include) && !is_test ? "not under oaslam/" : "";
  }
  const std::string inside = include.substr(std::string("oaslam/").size());
  const size_t slash = inside.find('/');
  if (slash == std::string::npos) {
    const auto owner = ImplementedIn().find(inside);
    const bool allowed = owner == ImplementedIn().end() || room == "public" ||
                         Closure(rooms, room).contains(owner->second);
    return allowed ? "" : room + " may not enter " + owner->second;
  }
  if (room == "public") return "a public header may not show a room";
  const std::string target = inside.substr(0, slash);
  if (!rooms.contains(target)) return "no such room";
  return Closure(rooms, room).contains(target) ? "" : room + " may not enter " + target;
}

std::vector<std::string> Violations(const Rooms& rooms, const std::vector<SourceFile>& files) {
  std::vector<std::string> found;
  for (const SourceFile& file : files) {
    const std::string room = file.path.substr(0, file.path.find('/'));
    if (room != "public" && !rooms.contains(room)) {
      found.push_back(file.path + ": a room that is not in the table");
      continue;
    }
    for (const std::string& include : IncludesOf(file.text))
      if (const std::string problem = Problem(rooms, file, include); !problem.empty())
        found.push_back(file.path + " includes " + include + ": " + problem);
  }
  return found;
}

// Types that the public headers name but do not define: an application could not use them.
std::vector<std::string> UndefinedTypes(const std::vector<SourceFile>& files) {
  static const std::regex type(R"(^(?:struct|class|enum class) (?:OASLAM_API )?(\w+)[^;{]*([;{]))");
  std::set<std::string> named, defined;
  for (const SourceFile& file : files) {
    if (!file.path.starts_with("public/")) continue;
    std::istringstream lines(file.text);
    std::smatch match;
    for (std::string line; std::getline(lines, line);)
      if (std::regex_search(line, match, type))
        (match[2] == ";" ? named : defined).insert(match[1].str());
  }
  std::vector<std::string> found;
  std::ranges::set_difference(named, defined, std::back_inserter(found));
  return found;
}

// Types that two headers define: all rooms share a namespace, and the linker takes the functions of
// either for both.
std::vector<std::string> TypesDefinedTwice(const std::vector<SourceFile>& files) {
  static const std::regex type(R"(^(?:struct|class|enum class) (?:OASLAM_\w+ )?([\w:]+)[^;{]*\{)");
  std::set<std::string> defined, twice;
  for (const SourceFile& file : files) {
    if (!file.path.ends_with(".h")) continue;
    std::istringstream lines(file.text);
    std::smatch match;
    for (std::string line; std::getline(lines, line);)
      if (std::regex_search(line, match, type) && !defined.insert(match[1]).second)
        twice.insert(match[1]);
  }
  return {twice.begin(), twice.end()};
}

std::vector<SourceFile> FilesUnder(const std::filesystem::path& folder, const std::string& prefix) {
  std::vector<SourceFile> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (extension != ".h" && extension != ".cc") continue;
    files.push_back(
        {prefix + std::filesystem::relative(entry.path(), folder).string(), TextOf(entry.path())});
  }
  return files;
}

TEST(IncludeGraph, TheCodeKeepsToTheArchitecture) {
  const std::filesystem::path root = OASLAM_SOURCE_DIR;
  std::vector<SourceFile> files = FilesUnder(root / "src" / "oaslam", "");
  for (SourceFile& header : FilesUnder(root / "include" / "oaslam", "public/"))
    files.push_back(std::move(header));
  ASSERT_GT(files.size(), 20u);
  EXPECT_THAT(Violations(Architecture(), files), ::testing::IsEmpty());
  EXPECT_THAT(UndefinedTypes(files), ::testing::IsEmpty());
  EXPECT_THAT(TypesDefinedTwice(files), ::testing::IsEmpty());
}

TEST(IncludeGraph, TypesOfOneNameAreFound) {
  EXPECT_THAT(
      TypesDefinedTwice({{"exports/a.h", "struct Scene {\n};\nstruct Other;\n"},
                         {"relocalization/b.h", "class Scene : Base {\n};\nstruct Other {\n};\n"}}),
      ::testing::ElementsAre("Scene"));
}

TEST(IncludeGraph, TypesThatAreNotInstalledAreFound) {
  const std::string face =
      "struct Inner;  // of a room\nstruct Later;\nclass Slam {\n  Inner Look();\n  class "
      "Impl;\n};\n";
  EXPECT_THAT(UndefinedTypes({{"public/slam.h", face},
                              {"public/later.h", "struct Later {\n};\n"},
                              {"map/inner.h", "struct Inner {\n};\n"}}),
              ::testing::ElementsAre("Inner"));
}

TEST(IncludeGraph, ThePageShowsTheRoomsOfTheBuild) {
  const Rooms page =
      RoomsOfPage(TextOf(std::filesystem::path(OASLAM_SOURCE_DIR) / "docs" / "architecture.md"));
  EXPECT_EQ(page, Architecture());
  EXPECT_GT(page.size(), 20u);
  EXPECT_EQ(ImplementedIn().at("slam.h"), "system");
}

// What programs of others see: the module for Python and the examples are such.
TEST(IncludeGraph, PythonAndTheExamplesSeeThePublicHeadersAlone) {
  const std::filesystem::path root = OASLAM_SOURCE_DIR;
  size_t count = 0;
  for (const char* folder : {"python", "examples"})
    for (const SourceFile& file : FilesUnder(root / folder, std::string(folder) + "/"))
      for (const std::string& include : IncludesOf(file.text))
        if (include.starts_with("oaslam/")) {
          EXPECT_TRUE(std::filesystem::exists(root / "include" / include))
              << file.path << " includes " << include;
          ++count;
        }
  EXPECT_GT(count, 10u);
}

TEST(IncludeGraph, NoCycles) {
  for (const auto& [room, below] : Architecture())
    for (const std::string& other : below)
      EXPECT_FALSE(Closure(Architecture(), other).contains(room)) << room << " " << other;
}

std::vector<std::string> Check(const std::string& path, const std::string& text) {
  return Violations(Architecture(), {{path, text}});
}

TEST(IncludeGraph, ForbiddenArrowsAreFound) {
  using ::testing::ElementsAre;
  EXPECT_THAT(
      Check("tracking/a.cc", "#include \"oaslam/mapping/b.h\"\n"),
      ElementsAre("tracking/a.cc includes oaslam/mapping/b.h: tracking may not enter mapping"));
  EXPECT_THAT(
      Check("objects/a_test.cc", "  #  include <oaslam/tracking/b.h>\n"),
      ElementsAre(
          "objects/a_test.cc includes oaslam/tracking/b.h: objects may not enter tracking"));
  EXPECT_THAT(Check("map/a.h", "#include \"oaslam/slam.h\""),
              ElementsAre("map/a.h includes oaslam/slam.h: map may not enter system"));
  EXPECT_THAT(
      Check("public/slam.h", "#include \"oaslam/map/map.h\""),
      ElementsAre("public/slam.h includes oaslam/map/map.h: a public header may not show a room"));
  EXPECT_THAT(Check("images/a.cc", "#include \"common.h\""),
              ElementsAre("images/a.cc includes common.h: not under oaslam/"));
  EXPECT_THAT(Check("images/a.cc", "#include \"oaslam/apps/common.h\""),
              ElementsAre("images/a.cc includes oaslam/apps/common.h: no such room"));
  EXPECT_THAT(Check("cellar/a.cc", ""),
              ElementsAre("cellar/a.cc: a room that is not in the table"));
}

TEST(IncludeGraph, AllowedArrowsPass) {
  EXPECT_THAT(
      Check("tracking/a.cc",
            "#include <vector>\n#include <opencv2/core.hpp>\n#include \"oaslam/tracking/a.h\"\n"
            "#include \"oaslam/matching/b.h\"\n#include \"oaslam/util/check.h\"\n#include "
            "\"oaslam/types.h\"\n"),
      ::testing::IsEmpty());
  EXPECT_THAT(Check("system/a.cc", "#include \"oaslam/slam.h\"\n#include \"oaslam/objects/b.h\"\n"),
              ::testing::IsEmpty());
  EXPECT_THAT(Check("map/a_test.cc", "#include \"synthetic_world.h\"\n"), ::testing::IsEmpty());
}

}  // namespace
}  // namespace oaslam
