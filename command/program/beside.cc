#include "beside.h"

#include <cctype>
#include <filesystem>

#include "default_detector.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/uri.h"

namespace oaslam::apps {

namespace fs = std::filesystem;

void AddPlainForm(CLI::App& app, PlainForm& form, CLI::Option* images) {
  auto* path = app.add_option(
      "path", form.images,
      "the images, as for --images; unless told otherwise, the default detector is used if it is "
      "here, and results are written beside the images");
  path->excludes(images);
  app.add_flag("--force", form.force,
               "overwrite the results that are there, as --images always does");
}

std::string FolderBeside(const std::string& images, const std::string& suffix) {
  if (IsCamera(images)) {
    std::string name = WithoutPassword(images);
    name = name.substr(0, name.find_first_of("?#"));  // there may be secrets, too
    while (name.ends_with('/')) name.pop_back();
    const auto is_plain = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
    std::string plain;
    for (const char c : name)
      if (is_plain(c) || c == '-' || c == '.')
        plain += c;
      else if (!plain.empty() && plain.back() != '_')
        plain += '_';
    return plain + suffix;
  }
  fs::path path = fs::path(images).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();  // "walk/"
  std::error_code error;
  if (path == "." || path.filename() == "..") path = fs::canonical(path, error);
  if (!path.has_filename())
    throw BadInput("{}: there is nothing beside it: --out DIR says where to write", images);
  const fs::path name = fs::is_directory(path, error) ? path.filename() : path.stem();
  return (path.parent_path() / name).string() + suffix;
}

void Complete(const PlainForm& form, const std::string& suffix, const PlainChoices& choices) {
  if (!form.IsUsed()) return;
  std::error_code error;
  if (!IsCamera(form.images) && !fs::exists(form.images, error))
    throw BadInput("{}: there is no such file or folder", form.images);
  choices.images = form.images;
  if (choices.out.empty()) choices.out = FolderBeside(form.images, suffix);
  // What run and localize write at their end.
  const auto has = [&](const char* name) {
    return fs::exists(fs::path(choices.out) / name, error);
  };
  if (!form.force && (has("summary.json") || has("poses.txt")))
    throw BadInput(
        "{}: there are results already; --force overwrites them, --out DIR writes elsewhere",
        choices.out);
  if (choices.detector.model.empty() && choices.detections.empty())
    choices.detector.model = DefaultDetectorOrOffer();
}

}  // namespace oaslam::apps
