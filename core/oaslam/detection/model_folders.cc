#include "oaslam/detection/model_folders.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <sstream>

#include "oaslam/detector.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/user_folders.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExtension = ".onnx";

bool IsFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

// The files that contain this code: the shared library, or the program that it is linked into.
std::vector<fs::path> OwnFiles() {
  std::vector<fs::path> files;
  std::error_code error;
  Dl_info info{};
  // The name of a program is the one that it was called by, which need not be a path.
  if (dladdr(reinterpret_cast<const void*>(&FindDetectorModel), &info) != 0 &&
      fs::path(info.dli_fname).has_parent_path())
    files.push_back(fs::canonical(info.dli_fname, error));
  files.push_back(fs::read_symlink("/proc/self/exe", error));
  return files;
}

// PREFIX/share/oaslam/models of the installation that the library or the program is in.
std::optional<fs::path> InstalledFolder() {
  constexpr int kMostLevels = 5;  // as in PREFIX/lib/python3/dist-packages/oaslam
  std::error_code error;
  for (const fs::path& file : OwnFiles()) {
    fs::path folder = file;
    for (int level = 0; level < kMostLevels && folder.has_relative_path(); ++level) {
      folder = folder.parent_path();
      if (const fs::path models = folder / "share/oaslam/models"; fs::is_directory(models, error))
        return models;
    }
  }
  return std::nullopt;
}

}  // namespace

std::string FileOfModel(const std::string& name) { return name + kExtension; }

bool IsModelName(const std::string& text) {
  const auto is_alphanumeric = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0;
  };
  return !text.empty() && text != "default" && text != "none" && is_alphanumeric(text.front()) &&
         !text.ends_with(kExtension) && std::ranges::all_of(text, [&](char c) {
           return is_alphanumeric(c) || c == '.' || c == '-' || c == '_';
         });
}

std::optional<fs::path> UserModelFolder() {
  const auto data = UserFolder("XDG_DATA_HOME", ".local/share");
  return data ? std::optional(*data / "oaslam" / "models") : std::nullopt;
}

std::vector<fs::path> ModelFolders() {
  std::vector<fs::path> folders;
  const auto add = [&](const fs::path& folder) {
    if (std::ranges::find(folders, folder) == folders.end()) folders.push_back(folder);
  };
  if (const char* given = std::getenv("OASLAM_MODELS")) {
    std::istringstream list(given);
    for (std::string folder; std::getline(list, folder, ':');)
      if (!folder.empty()) add(folder);
  }
  if (const auto folder = UserModelFolder()) add(*folder);
  if (const auto folder = InstalledFolder()) add(*folder);
  add("/usr/share/oaslam/models");
  return folders;
}

std::optional<fs::path> FindModel(const std::string& name) {
  for (const fs::path& folder : ModelFolders())
    if (const fs::path path = folder / FileOfModel(name); IsFile(path)) return path;
  return std::nullopt;
}

std::string FindDetectorModel(const std::string& model) {
  const std::string name = model == "default" ? kDefaultModel : model;
  if (!IsModelName(name)) return model;
  if (const auto found = FindModel(name)) return found->string();
  if (IsFile(model)) return model;
  std::vector<std::string> folders;
  for (const fs::path& folder : ModelFolders()) folders.push_back(folder.string());
  throw BadInput("no detector {0}: {1} is in none of {2}; {3}", name, FileOfModel(name),
                 fmt::join(folders, ", "),
                 name == kDefaultModel
                     ? fmt::format("`oaslam models get {}` fetches it", name)
                     : "`oaslam models` lists those that can be fetched, a file has a path");
}

}  // namespace oaslam
