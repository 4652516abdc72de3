#include "oaslam/models/catalogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "oaslam/detection/model_folders.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// As large as a message of Protocol Buffers, and so an ONNX file, can be.
constexpr int64_t kMostBytes = int64_t{1} << 31;

bool IsDigest(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

bool IsWebAddress(const std::string& text) {
  return text.starts_with("https://") || text.starts_with("http://");
}

// One entry of the catalogue; `place` names it in messages.
class EntryReader {
 public:
  EntryReader(const nlohmann::json& json, std::string place)
      : json_(json), place_(std::move(place)) {
    if (!json.is_object()) throw InputError(place_ + ": expected an object");
  }

  std::string Text(const char* key, bool (*is_valid)(const std::string&),
                   const char* expected) const {
    const auto found = json_.find(key);
    if (found == json_.end() || !found->is_string() ||
        !is_valid(found->get_ref<const std::string&>()))
      Refuse(key, expected);
    return *found;
  }
  std::string Text(const char* key) const {
    return Text(
        key, [](const std::string& text) { return !text.empty(); }, "a text");
  }
  int64_t Bytes(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end() || !found->is_number_integer() || *found < 1 || *found > kMostBytes)
      Refuse(key, fmt::format("a number of bytes from 1 to {}", kMostBytes));
    return *found;
  }

 private:
  [[noreturn]] void Refuse(const char* key, const std::string& expected) const {
    throw BadInput("{}.{}: expected {}", place_, key, expected);
  }

  const nlohmann::json& json_;
  std::string place_;
};

PublishedModel ReadEntry(const nlohmann::json& json, const std::string& place) {
  const EntryReader entry(json, place);
  return {.name = entry.Text("name", IsModelName, "letters, digits and .-_"),
          .finds = entry.Text("finds"),
          .bytes = entry.Bytes("bytes"),
          .sha256 = entry.Text("sha256", IsDigest, "64 hexadecimal digits of lower case"),
          .licence = entry.Text("licence"),
          .author = entry.Text("author"),
          .url = entry.Text("url", IsWebAddress, "https://... or http://...")};
}

// Null or text that is not empty.
const char* Environment(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

}  // namespace

std::vector<PublishedModel> ParseModelCatalogue(const std::string& text,
                                                const std::string& source) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  const auto models = json.is_object() ? json.find("models") : json.end();
  if (json.is_discarded() || !json.is_object() || models == json.end() || !models->is_array())
    throw InputError(source + ": expected JSON with a list \"models\"");
  std::vector<PublishedModel> catalogue;
  for (const nlohmann::json& entry : *models) {
    const std::string place = fmt::format("{}: models[{}]", source, catalogue.size());
    PublishedModel model = ReadEntry(entry, place);
    if (FindPublished(catalogue, model.name) != nullptr)
      throw BadInput("{}.name: {} is there twice", place, model.name);
    catalogue.push_back(std::move(model));
  }
  return catalogue;
}

std::vector<PublishedModel> ModelCatalogue() {
  const char* file = Environment("OASLAM_MODELS_CATALOGUE");
  std::vector<PublishedModel> catalogue =
      file != nullptr ? ParseModelCatalogue(ReadTextFile(file), file)
                      : ParseModelCatalogue(std::string(ModelCatalogueText()), "data/models.json");
  if (const char* mirror = Environment("OASLAM_MODELS_URL")) {
    std::string base = mirror;
    if (!IsWebAddress(base))
      throw BadInput("OASLAM_MODELS_URL: {}: expected https://... or http://...", base);
    while (base.ends_with('/')) base.pop_back();
    for (PublishedModel& model : catalogue)
      model.url = base + model.url.substr(model.url.rfind('/'));
  }
  return catalogue;
}

const PublishedModel* FindPublished(const std::vector<PublishedModel>& catalogue,
                                    const std::string& name) {
  const auto found = std::ranges::find(catalogue, name, &PublishedModel::name);
  return found != catalogue.end() ? &*found : nullptr;
}

std::string SizeText(int64_t bytes) {
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6);
}

}  // namespace oaslam
