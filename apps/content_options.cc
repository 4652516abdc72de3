#include "content_options.h"

namespace oaslam::apps {

CLI::Option* AddModelOption(CLI::App& app, std::vector<std::string>& files) {
  return app
      .add_option("--model", files,
                  "a model of virtual content (.glb, .gltf), named as its file; may be repeated")
      ->type_name("FILE")
      ->expected(1)
      ->take_all();
}

std::shared_ptr<const ModelLibrary> LoadModels(const std::vector<std::string>& files,
                                               bool with_meshes) {
  const auto models = std::make_shared<ModelLibrary>(files);
  if (with_meshes) models->LoadMeshes();
  return models;
}

}  // namespace oaslam::apps
