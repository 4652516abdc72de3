#include "oaslam/content/model_library.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "oaslam/content/builtin_models.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

std::string ContentType(const std::string& path) {
  static const std::map<std::string, std::string> kTypes = {
      {".glb", "model/gltf-binary"}, {".gltf", "model/gltf+json"}, {".png", "image/png"},
      {".jpg", "image/jpeg"},        {".jpeg", "image/jpeg"},      {".webp", "image/webp"},
      {".ktx2", "image/ktx2"}};
  const auto it = kTypes.find(LowerExtension(path));
  return it == kTypes.end() ? "application/octet-stream" : it->second;
}

// Why a path in a .gltf file does not name a file in its folder or below; empty if it does.
std::string Objection(const std::string& path) {
  if (path.empty() || path.find('\0') != std::string::npos) return "no name of a file";
  // A scheme ("http:", "C:") makes a path absolute, as a slash does.
  if (path.front() == '/' || path.find_first_of(":\\") != std::string::npos)
    return "an absolute address; allowed: files of its own folder and below";
  for (const fs::path& part : fs::path(path))
    if (part == "..") return "leads out of its folder; allowed: files of its own folder and below";
  return "";
}

// The files that a .gltf refers to, relative to its folder. Throws InputError.
std::vector<std::string> ReferencesOf(const std::string& file) {
  const auto document = nlohmann::json::parse(ReadTextFile(file), nullptr, false);
  if (!document.is_object()) throw BadInput("{}: not a glTF file: not a JSON object", file);
  std::vector<std::string> references;
  for (const char* key : {"buffers", "images"}) {
    const auto list = document.find(key);
    if (list == document.end()) continue;
    if (!list->is_array()) throw BadInput("{}: {}: not a list", file, key);
    for (const auto& item : *list) {
      const auto uri = item.is_object() ? item.find("uri") : item.end();
      if (uri == item.end()) continue;
      if (!uri->is_string()) throw BadInput("{}: {}: uri: not a text", file, key);
      const auto& text = uri->get_ref<const std::string&>();
      if (text.starts_with("data:")) continue;
      const std::string path = DecodePercent(text).value_or(text);
      if (const std::string objection = Objection(path); !objection.empty())
        throw BadInput("{}: {}: uri {}: {}", file, key, text, objection);
      std::error_code error;
      if (!fs::is_regular_file(fs::path(file).parent_path() / path, error))
        throw BadInput("{}: {}: uri {}: there is no such file", file, key, text);
      references.push_back(path);
    }
  }
  return references;
}

}  // namespace

ModelLibrary::ModelLibrary(const std::vector<std::string>& files) {
  const std::pair<std::string, std::string_view> builtin[] = {{"flag", FlagModel()},
                                                              {"arrow", ArrowModel()},
                                                              {"cube", CubeModel()},
                                                              {"tree", TreeModel()},
                                                              {"robot", RobotModel()}};
  for (const auto& [name, glb] : builtin) {
    names_.push_back(name);
    entries_[name] = name + "/" + name + ".glb";
    glbs_[entries_[name]] = glb;
  }
  for (const std::string& file : files) AddFile(file);
}

void ModelLibrary::AddFile(const std::string& file) {
  const fs::path path = file;
  const std::string extension = LowerExtension(file), name = path.stem().string();
  if (extension != ".glb" && extension != ".gltf")
    throw BadInput("{}: not a model that can be shown; allowed: .glb, .gltf", file);
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw BadInput("{}: there is no such file", file);
  if (entries_.contains(name)) {
    const auto other = user_models_.find(name);
    throw BadInput("{}: there is a model of the name {} already{}", file, name,
                   other == user_models_.end() ? ", a built-in one" : ": " + other->second);
  }
  const std::string main = path.filename().string();
  if (extension == ".gltf")
    for (const std::string& reference : ReferencesOf(file))
      user_files_[name + "/" + fs::path(reference).lexically_normal().generic_string()] =
          (path.parent_path() / reference).string();
  user_files_[name + "/" + main] = file;
  user_models_[name] = file;
  names_.push_back(name);
  entries_[name] = EncodeUriSegment(name) + "/" + EncodeUriSegment(main);
}

std::string ModelLibrary::entry(const std::string& name) const { return entries_.at(name); }

std::optional<ModelLibrary::File> ModelLibrary::Find(std::string_view path) const {
  for (const std::string& key :
       {std::string(path), DecodePercent(path).value_or(std::string(path))}) {
    if (const auto glb = glbs_.find(key); glb != glbs_.end())
      return File{ContentType(key), glb->second, ""};
    if (const auto file = user_files_.find(key); file != user_files_.end())
      return File{ContentType(key), "", file->second};
  }
  return std::nullopt;
}

}  // namespace oaslam
