#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/content/mesh.h"

namespace oaslam {

// The models of virtual content that there are, by name: those that are built in, and files of the
// user.
class ModelLibrary {
 public:
  struct File {
    std::string content_type;
    std::string_view bytes;  // of a built-in model, as long as the library
    std::string path;        // else, in the file system
  };

  // `files` are .glb or .gltf, named by their stems. A .gltf may refer to files of its own folder
  // and below. Throws InputError: not there, another extension, a name twice, a .gltf that is none
  // or refers elsewhere or to what is not there.
  explicit ModelLibrary(const std::vector<std::string>& files = {});

  const std::vector<std::string>& names() const { return names_; }  // built-in ones first
  // Where a model is found below /models/, as it stands in a URL: "flag/flag.glb",
  // "lamp/lamp.gltf".
  std::string entry(const std::string& name) const;
  // What lies there, e.g. "lamp/lamp.bin", with or without the triplets of a URL: of the user's
  // files, those that were named and those that they refer to; nothing for anything else.
  std::optional<File> Find(std::string_view path) const;

  // Reads the user's models for FindMesh. Throws InputError as LoadMesh does.
  void LoadMeshes();
  // Null where there is no such model, or it was not loaded.
  const Mesh* FindMesh(const std::string& name) const;

 private:
  void AddFile(const std::string& file);

  std::vector<std::string> names_;
  std::map<std::string, std::string> entries_;  // by name
  std::map<std::string, std::string>
      user_files_;                           // paths in the file system by path below /models/
  std::map<std::string, std::string> glbs_;  // bytes of the built-in ones, by path below /models/
  std::map<std::string, std::string> user_models_;  // main files by name
  std::map<std::string, Mesh> meshes_;              // by name
};

}  // namespace oaslam
