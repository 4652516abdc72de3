#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "oaslam/content/model_library.h"

namespace oaslam::apps {

// --model, may be repeated. Returns the option.
CLI::Option* AddModelOption(CLI::App& app, std::vector<std::string>& files);

// The built-in models of virtual content and those of files; `with_meshes`: load their meshes, for
// drawing by the program itself. Throws InputError.
std::shared_ptr<const ModelLibrary> LoadModels(const std::vector<std::string>& files,
                                               bool with_meshes);

}  // namespace oaslam::apps
