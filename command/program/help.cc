#include "help.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "oaslam/formats/text.h"

namespace oaslam::apps {
namespace {

constexpr const char* kMore = "More";
constexpr const char* kRobot = "ROS 2";
constexpr std::array kGroups = {kRobot, "Input", "Camera", "Objects", "Output", "Live", kMore};

// The options that are not of the last group.
const std::map<std::string, std::vector<std::string>>& OptionsOfGroups() {
  static const std::map<std::string, std::vector<std::string>> options = {
      {kRobot,
       {"domain", "map-frame", "odom-frame", "base-frame", "publish-camera-tf", "tf-ahead",
        "read-only"}},
      {"Input",
       {"images", "dataset", "time-unit", "from", "to", "fps", "exif-rotation", "follow", "map",
        "map-in", "maps", "submap", "imu", "gravity", "groundtruth", "trajectory"}},
      {"Camera", {"camera", "refine-camera", "rolling-shutter", "mask"}},
      {"Objects",
       {"detections", "detector", "detector-layout", "detector-size", "detector-min-score",
        "detector-backend", "detect-every", "classes", "scale", "scale-object"}},
      {"Output",
       {"out", "map-out", "force", "resume", "record", "model", "report", "scale-from",
        "keep-images", "quiet", "verbose"}},
      {"Live",
       {"mode", "viewer", "viewer-stay", "viewer-paused", "port", "bind", "host", "tls-cert",
        "tls-key", "tls-self-signed", "token-file", "insecure"}}};
  return options;
}

// Of a command with more options than a person reads: those that most people need.
bool IsOftenNeeded(const std::string& option) {
  static const std::set<std::string> options = {
      "images",  "map",      "map-in",      "submap", "from",       "to",
      "fps",     "imu",      "camera",      "mask",   "detections", "out",
      "map-out", "detector", "classes",     "force",  "record",     "scale-object",
      "mode",    "quiet",    "every-frame", "viewer", "port"};
  return options.contains(option);
}

std::string GroupOf(const std::string& option) {
  for (const auto& [group, names] : OptionsOfGroups())
    if (std::ranges::find(names, option) != names.end()) return group;
  return kMore;
}

// CLI11 has the groups in the order of their first options, which begins with --help.
class InOrder : public CLI::Formatter {
 public:
  // `is_long`: --help shows a part, --help-all the rest.
  explicit InOrder(bool is_long) : is_long_(is_long) {}

  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    std::string text =
        make_description(app) + make_usage(app, std::move(name)) + make_positionals(app);
    for (const char* group : kGroups) {
      const auto options = app->get_options([&](const CLI::Option* option) {
        const bool is_shown = !is_long_ || mode == CLI::AppFormatMode::All || group == kRobot ||
                              IsOftenNeeded(option->get_single_name()) ||
                              option == app->get_help_ptr() || option == app->get_help_all_ptr();
        return is_shown && option->get_group() == group && option->nonpositional();
      });
      if (!options.empty()) text += make_group(group, false, options);
    }
    return text;
  }

 private:
  const bool is_long_;
};

// The nearest word with so few wrong letters that it is probably meant; empty: none.
std::string Nearest(const std::string& word, const std::vector<std::string>& words) {
  const std::string nearest = words.empty() ? "" : NearestOf(words, word);
  const size_t most = std::max<size_t>(2, word.size() / 3);
  return EditDistance(nearest, word) <= static_cast<int>(most) ? nearest : "";
}

}  // namespace

void GroupOptions(CLI::App& app) {
  constexpr size_t kMany = 12;  // fewer are read without headings
  constexpr size_t kLong = 30;  // more are not read
  for (CLI::App* command : app.get_subcommands({})) {
    const size_t count = command->get_options().size();
    const bool is_long = count > kLong;
    if (count >= kMany) {
      command->formatter(std::make_shared<InOrder>(is_long));
      for (CLI::Option* option : command->get_options())
        if (option->nonpositional()) option->group(GroupOf(option->get_single_name()));
    }
    command->set_help_all_flag("--help-all", "Print all options and exit")
        ->group(is_long ? kMore : "");
  }
}

std::string UnknownOption(const CLI::App& app) {
  for (const std::string& given : app.remaining(true))
    if (given.size() > 1 && given.starts_with("-")) return given.substr(0, given.find('='));
  return "";
}

std::string DidYouMean(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  for (const std::string& given : app.remaining(true)) {
    const std::string word = given.substr(0, given.find('='));
    std::vector<std::string> words;
    if (word.starts_with("-"))
      for (const CLI::Option* option : command->get_options())
        for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    else
      for (const CLI::App* known : command->get_subcommands({})) words.push_back(known->get_name());
    const std::string meant = Nearest(word, words);
    if (!meant.empty()) return fmt::format("Did you mean {} instead of {}?", meant, word);
  }
  return "";
}

}  // namespace oaslam::apps
