#include "common.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <memory>
#include <utility>

#include "oaslam/config_file.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/images/dataset.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/printable.h"

namespace oaslam::apps {
namespace {

constexpr const char* kClearLine = "\r\033[K";
// Frames between plain lines when the total is not known: a line every few seconds.
constexpr int kPlainStepUnknownTotal = 100;

// The text of a message, which may quote a file.
class PrintableText : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const std::string text = Printable({message.payload.data(), message.payload.size()});
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableText>();
  }
};

std::string Duration(double seconds) {
  const int s = static_cast<int>(seconds + 0.5);
  return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                   : fmt::format("{}:{:02}", s / 60, s % 60);
}

// Without an error where the terminal is gone: the results count.
void PutOnStderr(const std::string& text) { std::fputs(text.c_str(), stderr); }

}  // namespace

CLI::Option* AddRepeatable(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                           const std::string& description) {
  return app.add_option(name, values, description)->expected(1)->take_all();
}

void AddQuietOption(CLI::App& app, CommonOptions& options) {
  app.add_flag_function(
      "--quiet",
      [&options](int64_t) {
        options.quiet = true;
        spdlog::set_level(spdlog::level::warn);
      },
      "No progress and no messages: results only");
  app.add_flag_function(
         "--verbose", [](int64_t) { spdlog::set_level(spdlog::level::debug); },
         "All messages, such as why objects were merged or dropped")
      ->excludes("--quiet");
}

void AddConfigOptions(CLI::App& app, CommonOptions& options) {
  app.add_option("--config", options.config, "Configuration file (YAML: sections of keys)")
      ->type_name("YAML");
  AddRepeatable(app, "--set", options.set,
                "Sets one configuration key, e.g. tracking.min_inliers=25; may be repeated")
      ->type_name("KEY=VALUE");
}

void AddFrameOptions(CLI::App& app, CommonOptions& options) {
  app.add_option("--from", options.from, "First frame, counted from 0")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--to", options.to, "One past the last frame")->check(CLI::NonNegativeNumber);
  app.add_option("--fps", options.fps,
                 "Frames a second, for images without time stamps, and in place of a video's own");
  app.add_option("--time-unit", options.time_unit,
                 "Unit of the time stamps in a list or in names of images, where they are not s")
      ->type_name("s|ms|us|ns")
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}));
}

void AddImageOptions(CLI::App& app, CommonOptions& options) {
  app.add_flag("--exif-rotation", options.exif_rotation,
               "Turn image files as their EXIF orientation says; calibration and boxes are of the "
               "turned images then");
  app.add_option("--dataset", options.dataset,
                 fmt::format("layout of a folder, of which images, times, camera, gyroscope and "
                             "ground truth are taken: {}, or none; by default told by its files. "
                             "none, with a recording of ROS: its images alone",
                             fmt::join(DatasetLayouts(), ", ")))
      ->type_name("NAME|none");
  app.add_option("--topic", options.topic,
                 "topic of the images in a recording of ROS (oaslam info lists them); by default "
                 "its only one")
      ->type_name("NAME");
}

void AddFollowOption(CLI::App& app, CommonOptions& options) {
  app.add_option("--follow", options.follow_s,
                 "The folder of images grows: take new ones as they come, until a file named stop "
                 "is in it, Ctrl-C, or SECONDS without one")
      ->type_name("[SECONDS]")
      ->check(CLI::Range(0.0, 1e6));
}

void AddSubmapOption(CLI::App& app, int& submap) {
  app.add_option("--submap", submap,
                 "of a map in several submaps: which one, as `oaslam info` counts them; default 0, "
                 "the largest")
      ->type_name("N");
}

void AddClassesOption(CLI::App& app, CommonOptions& options) {
  app.add_option("--classes", options.classes,
                 "Classes: names, parts, what moves (YAML \"names: {41: cup}\"; or a name a line); "
                 "default: COCO")
      ->type_name("FILE");
  app.add_option("--category-ids", options.category_ids,
                 "how --detections numbers COCO's classes: 0 to 79, or 1 to 90 as COCO itself")
      ->type_name("coco80|coco91")
      ->check(CLI::IsMember({"coco80", "coco91"}));
}

void AddRelocalizationOption(CLI::App& app, std::string& mode, const std::string& description) {
  app.add_option("--relocalization", mode, description)
      ->check(CLI::IsMember({"points", "objects", "points+objects"}))
      ->capture_default_str();
}

void AddCommonOptions(CLI::App& app, CommonOptions& options) {
  AddFrameOptions(app, options);
  AddClassesOption(app, options);
  AddConfigOptions(app, options);
  AddQuietOption(app, options);
}

std::pair<std::string, std::string> SplitValue(const std::string& text, char separator,
                                               const std::string& whole, const char* form) {
  const size_t at = text.find(separator);
  if (at == std::string::npos || at == 0 || at + 1 == text.size())
    throw BadInput("{} is not of the form {}", whole, form);
  return {text.substr(0, at), text.substr(at + 1)};
}

uint32_t ParseId(const std::string& text, const std::string& whole, const std::string& what) {
  uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > 100'000'000)
    throw BadInput("{}: \"{}\" is not {}", whole, text, what);
  return value;
}

SlamConfig LoadConfiguration(const CommonOptions& options, SlamConfig config) {
  if (!options.config.empty()) LoadConfig(options.config, config);
  for (const std::string& assignment : options.set) {
    try {
      ApplySetting(assignment, config);
    } catch (const InputError& error) {
      throw BadInput("--set {}", error.what());
    }
  }
  if (const auto problems = config.Validate(); !problems.empty())
    throw BadInput("configuration: {}", fmt::join(problems, "\n"));
  return config;
}

Classes LoadClasses(const CommonOptions& options) {
  return options.classes.empty() ? Classes{CocoClassNames(), {}}
                                 : oaslam::LoadClasses(options.classes);
}

ImageSourceOptions FrameRange(const CommonOptions& options) {
  ImageSourceOptions range{.fps = options.fps, .from = options.from, .to = options.to};
  range.time_unit = SecondsInUnit(options.time_unit);
  range.dataset = options.dataset;
  range.topic = options.topic;
  if (options.exif_rotation) range.orientation = Orientation::kUpright;
  if (options.follow_s) range.follow = FollowOptions{*options.follow_s};
  range.stopped = Interrupted;
  return range;
}

OutputFolder::OutputFolder(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  // With the dot, "out" and "out/" have the same parent: the folder itself.
  std::vector<fs::path> missing;
  for (fs::path p = (fs::absolute(path) / ".").lexically_normal().parent_path();
       !fs::exists(p, error); p = p.parent_path())
    missing.push_back(p);
  for (size_t i = missing.size(); i-- > 0;)
    if (fs::create_directory(missing[i], error)) {
      created_.insert(created_.begin(), missing[i]);
      leftovers_.emplace_back(missing[i].string());
    }
  const bool is_there = fs::is_directory(path, error);
  const fs::path probe = fs::path(path) / fmt::format(".oaslam-{}", getpid());
  const bool is_writable = is_there && static_cast<bool>(std::ofstream(probe) << "x" << std::flush);
  fs::remove(probe, error);
  if (is_writable) return;
  RemoveWhatIsEmpty();
  throw BadInput("{}: the folder cannot be {}", path, is_there ? "written to" : "created");
}

OutputFolder::~OutputFolder() { RemoveWhatIsEmpty(); }

void OutputFolder::RemoveWhatIsEmpty() {
  std::error_code error;
  for (const std::filesystem::path& folder : created_)
    if (!std::filesystem::remove(folder, error)) return;
}

OutputFolder FolderOfOutputFile(const std::string& path, const std::string& option) {
  if (std::filesystem::is_directory(path))
    throw BadInput("{}: a folder, {} asks for a file", path, option);
  const std::string folder = std::filesystem::path(path).parent_path().string();
  try {
    return OutputFolder(folder.empty() ? "." : folder);
  } catch (const InputError& error) {
    throw BadInput("{} {}: {}", option, path, error.what());
  }
}

OutputFolder FolderOfMapFile(const std::string& path, const std::string& option) {
  std::error_code error;
  if (std::filesystem::is_other(std::filesystem::status(path, error)))
    throw BadInput("{}: is no regular file, {} asks for one", path, option);
  return FolderOfOutputFile(path, option);
}

void SetMessagePattern(const std::string& before) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableText>('*').set_pattern(before + "%^%l%$: %*");
  spdlog::set_formatter(std::move(formatter));
}

ProgressBar::ProgressBar(int total, bool quiet)
    : total_(total),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()) {
  // A message replaces the line of the bar, which is drawn again below it.
  if (terminal_ && !quiet_) SetMessagePattern(kClearLine);
}

ProgressBar::~ProgressBar() { Finish(); }

std::string ProgressBar::Line(const std::string& state, double seconds) const {
  const double rate = seconds > 0 ? done_ / seconds : 0;
  if (total_ <= 0) return fmt::format("{} frames  {:.1f}/s  {}", done_, rate, state);
  const double left = rate > 0 ? std::max(total_ - done_, 0) / rate : 0;
  return fmt::format("{:3.0f} %  {}/{}  {:.1f}/s  {} left  {}", 100.0 * done_ / total_, done_,
                     total_, rate, Duration(left), state);
}

void ProgressBar::Update(int done, const std::string& state) {
  if (quiet_ || finished_) return;
  done_ = done;
  state_ = state;
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (terminal_) {
    if (drawn_s_ >= 0 && seconds - drawn_s_ < 0.1) return;
    drawn_s_ = seconds;
    PutOnStderr(kClearLine + Line(state, seconds));
  } else if (done - printed_ >=
             (total_ > 0 ? std::max((total_ + 9) / 10, 1) : kPlainStepUnknownTotal)) {
    printed_ = done;
    PutOnStderr(Line(state, seconds) + "\n");
  }
}

void ProgressBar::Finish() {
  if (finished_ || quiet_) return;
  finished_ = true;
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (terminal_) {
    SetMessagePattern("");
    PutOnStderr(fmt::format("{}{} frames in {}\n", kClearLine, done_, Duration(seconds)));
  } else if (done_ > printed_) {
    PutOnStderr(Line(state_, seconds) + "\n");
  }
}

}  // namespace oaslam::apps
