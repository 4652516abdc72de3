#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "default_detector.h"
#include "fetch.h"
#include "oaslam/crypto/sha256.h"
#include "oaslam/detection/model_folders.h"
#include "oaslam/formats/text.h"
#include "oaslam/models/model_store.h"
#include "oaslam/util/bad_input.h"
#include "server_commands.h"

namespace oaslam::apps {
namespace {

namespace fs = std::filesystem;

struct ModelsOptions {
  std::string name;  // what to fetch, or the name of what is added
  std::string file;
  bool force = false, quiet = false;
  int timeout_s = DownloadOptions{}.timeout_s;
};

// Whether a file is the published one; false where it cannot be read.
bool IsPublished(const fs::path& path, const PublishedModel& model) {
  try {
    return Sha256Of(ReadTextFile(path.string())) == model.sha256;
  } catch (const InputError&) {
    return false;
  }
}

// Where a published model is. A file of its name that is another one is used, but said.
std::string WhereIs(const PublishedModel& model) {
  const auto path = FindModel(model.name);
  if (!path) return fmt::format("not here: oaslam models get {}", model.name);
  return fmt::format("here: {}{}", path->string(),
                     IsPublished(*path, model) ? "" : ", which is not the published file");
}

void PrintPlace(const std::string& name, const fs::path& path) {
  fmt::print("{} is in {}\n", name, path.string());
  if (const auto used = FindModel(name); used && *used != path)
    spdlog::warn("{} is found first, and used instead", used->string());
}

void PrintOthers(const std::vector<PublishedModel>& catalogue) {
  std::set<std::string> shown;
  for (const fs::path& folder : ModelFolders())
    for (const std::string& name : DetectorsIn(folder))
      if (FindPublished(catalogue, name) == nullptr && shown.insert(name).second)
        fmt::print("{}\n  here: {}\n", name, (folder / FileOfModel(name)).string());
}

void ListModels() {
  const std::vector<PublishedModel> catalogue = ModelCatalogue();
  for (const PublishedModel& model : catalogue)
    fmt::print("{}{}: {}, {}, {} ({})\n  published at {}\n  {}\n", model.name,
               model.name == kDefaultModel ? " (default)" : "", model.finds, SizeText(model.bytes),
               model.licence, model.author, WithoutPassword(model.url), WhereIs(model));
  PrintOthers(catalogue);
  std::vector<std::string> folders;
  for (const fs::path& folder : ModelFolders()) folders.push_back(folder.string());
  fmt::print("\nlooked for in {}\n", fmt::join(folders, ", "));
}

int GetModel(const ModelsOptions& options) {
  const std::vector<PublishedModel> catalogue = ModelCatalogue();
  const std::string name = options.name == "default" ? kDefaultModel : options.name;
  const PublishedModel* model = FindPublished(catalogue, name);
  if (model == nullptr) {
    std::vector<std::string> names;
    for (const PublishedModel& known : catalogue) names.push_back(known.name);
    throw BadInput("models get {}: not in the catalogue, which has {}", name,
                   fmt::join(names, ", "));
  }
  auto path = FindModel(name);
  if (!path || !IsPublished(*path, *model))
    path = FetchForUser(*model, options.force, options.timeout_s, options.quiet);
  if (!path) {
    spdlog::info("interrupted: nothing is kept");
    return 130;
  }
  PrintPlace(name, *path);
  return 0;
}

void AddOneModel(const ModelsOptions& options) {
  const fs::path path =
      AddModel(options.file, options.name, FolderForModels(), options.force, ModelCatalogue());
  const std::string name = path.stem().string();
  PrintPlace(name, path);
  fmt::print("to use it: --detector {}\n", name);
}

}  // namespace

void AddModelsCommand(CLI::App& app) {
  auto* command = app.add_subcommand("models", "List the detectors, fetch or add one");
  command->require_subcommand(0, 1);
  const auto options = std::make_shared<ModelsOptions>();
  auto* get = command->add_subcommand("get", "Fetch a detector of the catalogue");
  get->add_option("name", options->name, "its name, as `oaslam models` lists it")->required();
  get->add_option("--timeout", options->timeout_s,
                  "seconds to wait for a connection, and for the next bytes")
      ->check(CLI::Range(1, 3600))
      ->capture_default_str();
  get->add_flag("--quiet", options->quiet, "no progress");
  auto* add = command->add_subcommand("add", "Take a detector from a file");
  add->add_option("file", options->file, "an ONNX file; it is copied")->required();
  add->add_option("--name", options->name,
                  "its name; by default that of the catalogue if it is published there, or else "
                  "the file's own")
      ->type_name("NAME");
  for (CLI::App* with_force : {get, add})
    with_force->add_flag("--force", options->force, "replace another file that has this name");
  // What `oaslam run` calls where the default detector is missing (OfferDetector).
  auto* offer = command->add_subcommand("offer", "Ask whether to fetch the default detector");
  offer->group("");
  offer->callback([] {
    if (const int code = OfferDefaultModel()) throw CLI::RuntimeError(code);
  });
  get->callback([options] {
    if (const int code = GetModel(*options)) throw CLI::RuntimeError(code);
  });
  add->callback([options] { AddOneModel(*options); });
  command->callback([command] {
    if (command->get_subcommands().empty()) ListModels();
  });
}

}  // namespace oaslam::apps
