#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// A detector that is published as an ONNX file.
struct PublishedModel {
  std::string name;    // of a detector (IsModelName)
  std::string finds;   // "the 80 classes of COCO"
  int64_t bytes = 0;   // of the file
  std::string sha256;  // of the file, in 64 hexadecimal digits of lower case
  std::string licence, author;
  std::string url;
};

// Reads a catalogue in JSON, of the form of data/models.json; `source` names it in messages. Throws
// InputError, which names the entry and the key.
std::vector<PublishedModel> ParseModelCatalogue(const std::string& text, const std::string& source);

// The catalogue of this program; that of a file instead where the environment names one in
// OASLAM_MODELS_CATALOGUE. If OASLAM_MODELS_URL is set, files are taken from that address (a
// mirror) instead of the folder that each URL names; their digests stay those of the catalogue.
// Throws InputError.
std::vector<PublishedModel> ModelCatalogue();

// Null where no entry has this name.
const PublishedModel* FindPublished(const std::vector<PublishedModel>& catalogue,
                                    const std::string& name);

// "3.7 MB".
std::string SizeText(int64_t bytes);

// data/models.json.
std::string_view ModelCatalogueText();

}  // namespace oaslam
