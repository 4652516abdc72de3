#pragma once

#include <string>

#include "oaslam/config.h"
#include "oaslam/export.h"

namespace oaslam {

// Reads a YAML file, sections of keys or `section.key: value`, into `config`; what it does not name
// stays. Throws one InputError with a line for each problem, and changes nothing then. An unknown
// key is a problem; its line names the nearest known one. Each value must be within the bounds of
// its key, as in SlamConfig::Validate.
OASLAM_API void LoadConfig(const std::string& path, SlamConfig& config);

// Applies one "section.key=value", with the same checks as for a file. Throws InputError, and
// changes nothing then.
OASLAM_API void ApplySetting(const std::string& assignment, SlamConfig& config);

// The whole configuration as YAML.
OASLAM_API std::string ConfigToYaml(const SlamConfig& config);

}  // namespace oaslam
