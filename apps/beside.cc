#include "beside.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "oaslam/error.h"

namespace oaslam::apps {

namespace fs = std::filesystem;

void AddPlainForm(CLI::App& app, PlainForm& form, CLI::Option* images) {
  app.add_option(
         "path", form.images,
         "the images, as for --images; what is not said is chosen: the camera is estimated, "
         "the default detector used, and results are written beside the images")
      ->excludes(images);
  app.add_flag("--force", form.force, "overwrite the results that are there");
}

std::string FolderBeside(const std::string& images, const std::string& suffix) {
  if (images.starts_with("webcam:")) {
    std::string name = images;
    std::ranges::replace(name, ':', '_');
    return name + suffix;
  }
  fs::path path = fs::path(images).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();  // "walk/"
  std::error_code error;
  if (path == "." || path == "..") path = fs::canonical(path, error);
  const fs::path name = fs::is_directory(path, error) ? path.filename() : path.stem();
  return (path.parent_path() / name).string() + suffix;
}

void EnsureNoResults(const std::string& folder, const PlainForm& form) {
  std::error_code error;
  if (form.force || !fs::is_directory(folder, error) || fs::is_empty(folder, error)) return;
  throw InputError(fmt::format(
      "{}: there are results already; --force overwrites them, --out DIR writes elsewhere",
      folder));
}

}  // namespace oaslam::apps
