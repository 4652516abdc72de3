#pragma once

#include <string>

#include "oaslam/config.h"
#include "oaslam/export.h"

namespace oaslam {

// Reads a YAML file with sections of keys into `config`; other values stay. An unknown key is an
// error that names the nearest known one; all problems of the file are reported in one InputError.
OASLAM_API void LoadConfig(const std::string& path, SlamConfig& config);

// Applies one "section.key=value", with the same checks as for a file.
OASLAM_API void ApplySetting(const std::string& assignment, SlamConfig& config);

// The whole configuration as YAML.
OASLAM_API std::string ConfigToYaml(const SlamConfig& config);

}  // namespace oaslam
