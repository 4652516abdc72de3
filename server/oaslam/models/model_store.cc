#include "oaslam/models/model_store.h"

#include <algorithm>

#include "oaslam/crypto/sha256.h"
#include "oaslam/detection/model_folders.h"
#include "oaslam/detection/onnx_info.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

void CreateFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw BadInput("{}: cannot be created: {}", folder.string(), error.message());
}

// Whether the file is there with this digest. Throws InputError if another file is there that is
// not to be replaced.
bool IsThere(const fs::path& path, const std::string& sha256, bool replace) {
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  const std::string found = Sha256Of(ReadTextFile(path.string()));
  if (found == sha256) return true;
  if (!replace)
    throw BadInput("{}: another file is there (SHA-256 {}); --force replaces it", path.string(),
                   found);
  return false;
}

}  // namespace

std::optional<fs::path> FetchModel(const PublishedModel& model, const fs::path& folder,
                                   bool replace, const DownloadOptions& options) {
  const fs::path path = folder / FileOfModel(model.name);
  if (IsThere(path, model.sha256, replace)) return path;
  CreateFolder(folder);
  const std::optional<std::string> bytes = Download(model.url, model.bytes, options);
  if (!bytes) return std::nullopt;
  if (const std::string found = Sha256Of(*bytes); found != model.sha256)
    throw BadInput(
        "{}: not the published {}, and not kept: its SHA-256 is {}, that of the catalogue {}",
        WithoutPassword(model.url), model.name, found, model.sha256);
  WriteTextFile(path.string(), *bytes);
  return path;
}

fs::path AddModel(const fs::path& file, std::string name, const fs::path& folder, bool replace,
                  const std::vector<PublishedModel>& catalogue) {
  const std::string bytes = ReadTextFile(file.string());
  if (!ParseOnnxInfo(bytes))
    throw BadInput("{}: not an ONNX file, or a damaged one", file.string());
  const std::string sha256 = Sha256Of(bytes);
  const auto known = std::ranges::find(catalogue, sha256, &PublishedModel::sha256);
  if (name.empty()) name = known != catalogue.end() ? known->name : file.stem().string();
  if (!IsModelName(name))
    throw BadInput(
        "{}: {} cannot be the name of a detector (letters, digits and .-_): --name gives another",
        file.string(), name);
  if (const PublishedModel* published = FindPublished(catalogue, name);
      published != nullptr && published->sha256 != sha256)
    throw BadInput(
        "{}: not the published {}: its SHA-256 is {}, that of the catalogue {}; --name "
        "gives it another name",
        file.string(), name, sha256, published->sha256);
  const fs::path path = folder / FileOfModel(name);
  if (IsThere(path, sha256, replace)) return path;
  CreateFolder(folder);
  WriteTextFile(path.string(), bytes);
  return path;
}

}  // namespace oaslam
