#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/config.h"
#include "oaslam/formats/leftover.h"
#include "oaslam/image_source.h"
#include "signals.h"

namespace oaslam::apps {

// Options that several commands share.
struct CommonOptions {
  bool quiet = false;
  std::string config;            // path, empty: defaults
  std::vector<std::string> set;  // section.key=value
  int from = 0, to = -1;         // frames [from, to); -1: to the end
  std::string classes;           // path, empty: COCO
  std::string category_ids;      // --category-ids: coco80 or coco91; empty: told by the file
  std::optional<double> fps;
  std::string time_unit;           // --time-unit: a name; empty: told by the times
  bool exif_rotation = false;      // image files are rotated by their metadata
  std::string topic;               // --topic, of a recording of ROS; empty: its only one
  std::string dataset;             // --dataset: a layout or none; empty: told by the files
  std::optional<double> follow_s;  // --follow: 0 without a limit
};

// An option that may be repeated, with a value each time.
CLI::Option* AddRepeatable(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                           const std::string& description);
void AddQuietOption(CLI::App& app, CommonOptions& options);    // --quiet, --verbose
void AddConfigOptions(CLI::App& app, CommonOptions& options);  // --config, --set
void AddFrameOptions(CLI::App& app, CommonOptions& options);   // --from, --to, --fps, --time-unit
void AddImageOptions(CLI::App& app, CommonOptions& options);  // --exif-rotation, --dataset, --topic
void AddFollowOption(CLI::App& app, CommonOptions& options);  // --follow
void AddSubmapOption(CLI::App& app, int& submap);             // --submap, of a map file
void AddClassesOption(CLI::App& app, CommonOptions& options);
// --relocalization. `mode` must hold the default.
void AddRelocalizationOption(CLI::App& app, std::string& mode, const std::string& description);
// All of them. `options` must outlive the parsing.
void AddCommonOptions(CLI::App& app, CommonOptions& options);

// The two parts of a value, neither of which may be empty. Throws InputError, which says that
// `whole`, of which `text` is a part, is not of this form.
std::pair<std::string, std::string> SplitValue(const std::string& text, char separator,
                                               const std::string& whole, const char* form);

// A number from 0 to 100,000,000. Throws InputError, which says that the text in `whole` "is not
// `what`".
uint32_t ParseId(const std::string& text, const std::string& whole, const std::string& what);

// --config, then --set, then validation; all problems in one InputError. `config`: the defaults.
SlamConfig LoadConfiguration(const CommonOptions& options,
                             SlamConfig config = SlamConfig::Offline());
// The classes of --classes, else those of COCO.
Classes LoadClasses(const CommonOptions& options);
ImageSourceOptions FrameRange(const CommonOptions& options);

// A folder for results. The destructor removes the folders that it created and that are still
// empty, as they are where the input was refused.
class OutputFolder {
 public:
  // Creates the folder and checks that it can be written to. Throws InputError.
  explicit OutputFolder(const std::string& path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

 private:
  void RemoveWhatIsEmpty();

  std::vector<std::filesystem::path> created_;  // the innermost one first
  std::deque<Leftover> leftovers_;              // those, the outermost one first
};

// The folder of a file, which must not be a folder itself. `option` gave the path. Throws
// InputError.
[[nodiscard]] OutputFolder FolderOfOutputFile(const std::string& path,
                                              const std::string& option = "--out");
// The same for a map file, which cannot be a device either, since it is replaced as a whole.
[[nodiscard]] OutputFolder FolderOfMapFile(const std::string& path, const std::string& option);

// Messages are written as `before` and their text after it, of which nothing is a command to a
// terminal.
void SetMessagePattern(const std::string& before);

// Progress on stderr: one line on a terminal, a line every tenth otherwise, nothing when quiet.
class ProgressBar {
 public:
  // `total` below 0: unknown.
  ProgressBar(int total, bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(int done, const std::string& state);
  void Finish();

 private:
  std::string Line(const std::string& state, double seconds) const;

  int total_, done_ = 0;
  bool quiet_, terminal_, finished_ = false;
  int printed_ = 0;  // frames at the last plain line
  double drawn_s_ = -1;
  std::string state_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace oaslam::apps
