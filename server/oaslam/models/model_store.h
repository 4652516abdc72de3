#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/models/catalogue.h"
#include "oaslam/models/download.h"

namespace oaslam {

// Fetches a model into a folder, which is created, as NAME.onnx. The file is written once it is
// whole and its SHA-256 is that of the catalogue. Does nothing where it is there already.
// `replace`: also where another file has that name. Returns its path; nothing if `options.progress`
// stopped it. Throws InputError.
std::optional<std::filesystem::path> FetchModel(const PublishedModel& model,
                                                const std::filesystem::path& folder, bool replace,
                                                const DownloadOptions& options);

// Copies an ONNX file into a folder, which is created, as NAME.onnx. `name`: empty for that of the
// catalogue's entry with the same SHA-256, or else the file's own. `replace`: also where another
// file has that name. Returns its path. Throws InputError where the file is no ONNX file, or where
// the name is one of the catalogue, whose file is another.
std::filesystem::path AddModel(const std::filesystem::path& file, std::string name,
                               const std::filesystem::path& folder, bool replace,
                               const std::vector<PublishedModel>& catalogue);

}  // namespace oaslam
