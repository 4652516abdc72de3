#pragma once

#include <string>

#include "oaslam/config.h"

namespace oaslam {

// Reads a YAML file of sections of keys into `config` (its other values stay). An unknown key is an
// error that names the nearest known one; all problems of the file come in one InputError.
void LoadConfig(const std::string& path, SlamConfig& config);

// Applies one "section.key=value", with the strictness of the file.
void ApplySetting(const std::string& assignment, SlamConfig& config);

// The whole configuration as YAML.
std::string ConfigToYaml(const SlamConfig& config);

}  // namespace oaslam
