#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "oaslam/detector.h"
#include "oaslam/error.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// The files that contain this code: the shared library, or the program that it is linked into.
std::vector<std::string> OwnFiles() {
  std::vector<std::string> files;
  std::error_code error;
  Dl_info info{};
  // The name of a program is the one that it was called by, which need not be a path.
  if (dladdr(reinterpret_cast<const void*>(&DefaultDetectorModel), &info) != 0 &&
      fs::path(info.dli_fname).has_parent_path())
    files.push_back(fs::canonical(info.dli_fname, error));
  files.push_back(fs::read_symlink("/proc/self/exe", error));
  return files;
}

constexpr const char* kFile = "yolox_nano.onnx";

// The model in a folder that contains the library or the program, or around it: PREFIX/share of an
// installation, or data of the repository that it was built in. Empty where there is none.
std::string ModelAround(fs::path folder) {
  constexpr int kMostLevels = 5;  // as in PREFIX/lib/python3/dist-packages/oaslam
  std::error_code error;
  for (int level = 0; level < kMostLevels && folder.has_relative_path(); ++level) {
    folder = folder.parent_path();
    for (const char* models : {"share/oaslam/models", "data/models"})
      if (const fs::path path = folder / models / kFile; fs::is_regular_file(path, error))
        return path.string();
  }
  return "";
}

}  // namespace

std::string DefaultDetectorModel() {
  std::string tried;
  if (const char* given = std::getenv("OASLAM_MODELS"); given && *given) {
    std::error_code error;
    tried = (fs::path(given) / kFile).string();
    if (fs::is_regular_file(tried, error)) return tried;
  } else {
    for (const std::string& file : OwnFiles())
      if (std::string path = ModelAround(file); !path.empty()) return path;
    tried = fmt::format("share/oaslam/models/{} around {}", kFile, fmt::join(OwnFiles(), ", "));
  }
  throw InputError(
      fmt::format("the default detector is not there: {}; set OASLAM_MODELS to its folder, or go "
                  "on without a detector (--detector none)",
                  tried));
}

}  // namespace oaslam
