#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// The available models of virtual content by name: built-in ones, and files of the user.
class ModelLibrary {
 public:
  struct File {
    std::string content_type;
    std::string_view bytes;  // of a built-in model; always valid
    std::string path;        // of a user's file: its path in the file system
  };

  // `files` are .glb or .gltf, named by their stems. A .gltf may refer to files in its own folder
  // and below. Throws InputError where a file is missing, has another extension, a name that exists
  // already, or is a .gltf that is invalid or refers to files elsewhere or missing ones.
  explicit ModelLibrary(const std::vector<std::string>& files = {});

  const std::vector<std::string>& names() const { return names_; }  // built-in ones first
  // The path of a model below /models/, encoded for a URL: "flag/flag.glb", "lamp/lamp.gltf".
  std::string entry(const std::string& name) const;
  // The file at a path below /models/, e.g. "lamp/lamp.bin", URL-encoded or not. Only built-in
  // models, the user's files, and the files these refer to are found.
  std::optional<File> Find(std::string_view path) const;

 private:
  void AddFile(const std::string& file);

  std::vector<std::string> names_;
  std::map<std::string, std::string> entries_;  // by name
  std::map<std::string, std::string>
      user_files_;                                // paths in the file system by path below /models/
  std::map<std::string, std::string_view> glbs_;  // the built-in ones, by path below /models/
  std::map<std::string, std::string> user_models_;  // main files by name
};

}  // namespace oaslam
