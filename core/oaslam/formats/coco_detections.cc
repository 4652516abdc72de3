#include "oaslam/formats/coco_detections.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "oaslam/formats/detection_entry.h"
#include "oaslam/formats/rotated_box.h"

namespace oaslam {
namespace {

using Json = nlohmann::json;
using ImageList = std::map<int64_t, std::string>;

const Json& ListOf(const Json& root, const char* key, const std::string& path) {
  const JsonPlace place{path, "file"};
  const Json& list = place.Member(root, key);
  if (!list.is_array()) place.Refuse(fmt::format("{}: {}, expected a list", key, JsonText(list)));
  return list;
}

// [{"id": 1, "name": "person"}]; empty where there are none.
ClassNames ReadCategories(const Json& root, const std::string& path) {
  ClassNames names;
  if (!root.is_object() || !root.contains("categories")) return names;
  const Json& categories = ListOf(root, "categories", path);
  for (size_t i = 0; i < categories.size(); ++i) {
    const JsonPlace place{path, fmt::format("categories[{}]", i)};
    const Json& name = place.Member(categories[i], "name");
    if (!name.is_string()) place.Refuse(fmt::format("name: {}, expected a name", JsonText(name)));
    names[CategoryOf(place.Member(categories[i], "id"), "id", place)] = name.get<std::string>();
  }
  return names;
}

ImageList ReadImageList(const Json& images, const std::string& path) {
  ImageList list;
  for (size_t i = 0; i < images.size(); ++i) {
    const JsonPlace place{path, fmt::format("images[{}]", i)};
    const Json &id = place.Member(images[i], "id"), &name = place.Member(images[i], "file_name");
    if (!id.is_number_integer())
      place.Refuse(fmt::format("id: {}, expected a whole number", JsonText(id)));
    if (!name.is_string())
      place.Refuse(fmt::format("file_name: {}, expected a name", JsonText(name)));
    list[id.get<int64_t>()] = name.get<std::string>();
  }
  return list;
}

// COCO results name images by number; the list {"images": [{"id", "file_name"}]}, perhaps with
// "categories", is in another file beside them.
std::optional<ImageList> FindImageList(const std::string& path, ClassNames& categories) {
  const std::filesystem::path file(path);
  for (const auto& name : {file.stem().string() + ".images.json", std::string("images.json")}) {
    const std::string candidate = (file.parent_path() / name).string();
    if (!std::filesystem::exists(candidate)) continue;
    const Json root = ParseDetections(candidate);
    categories = ReadCategories(root, candidate);
    return ReadImageList(root.is_array() ? root : ListOf(root, "images", candidate), candidate);
  }
  return std::nullopt;
}

// The name of the image of a result: "file_name", as Ultralytics writes it, "image_id", or what the
// list says of that number; the number itself where there is no list.
std::string NameOfImage(const Json& result, const std::optional<ImageList>& list,
                        const JsonPlace& place) {
  const Json& id = place.Member(result, "image_id");
  if (result.contains("file_name") && result["file_name"].is_string())
    return result["file_name"].get<std::string>();
  if (id.is_string()) return id.get<std::string>();
  if (id.is_number_integer() && !list) return std::to_string(id.get<int64_t>());
  if (!id.is_number_integer() || !list->contains(id.get<int64_t>()))
    place.Refuse(fmt::format("image_id: {} is not in the image list", JsonText(id)));
  return list->at(id.get<int64_t>());
}

// The angle by which CVAT's box is rotated about its centre, which it writes as an attribute.
double RotationOf(const Json& result, const JsonPlace& place) {
  const auto attributes = result.find("attributes");
  if (attributes == result.end() || !attributes->is_object()) return 0;
  const auto rotation = attributes->find("rotation");
  return rotation == attributes->end() || !rotation->is_number()
             ? 0
             : place.Number(*rotation, "attributes.rotation");
}

DetectionFile ReadResults(const Json& results, std::optional<ImageList> list, ClassNames categories,
                          const std::string& path) {
  DetectionFile file{{}, std::move(categories), true};
  std::map<std::string, size_t> index;
  const auto image_of = [&](const std::string& name) -> ImageDetections& {
    const auto [found, is_new] = index.emplace(name, file.images.size());
    if (is_new) file.images.push_back({name, {}});
    return file.images[found->second];
  };
  const auto is_numbered = [](const Json& r) {
    return r.is_object() && r.contains("image_id") && r["image_id"].is_number_integer() &&
           !(r.contains("file_name") && r["file_name"].is_string());
  };
  if (!list && std::any_of(results.begin(), results.end(), is_numbered)) {
    list = FindImageList(path, file.categories);
    file.has_numbers_for_names = !list;
  }
  if (list)
    for (const auto& [id, name] : *list) image_of(name);
  LeftOut left_out;
  for (size_t i = 0; i < results.size(); ++i) {
    const JsonPlace place{path, fmt::format("entry {}", i)};
    const std::string name = NameOfImage(results[i], list, place);
    ImageDetections& image = image_of(name);
    left_out.Try([&] {
      const JsonPlace named{path, fmt::format("entry {} ({})", i, name)};
      Detection detection;
      detection.category_id = ReadCategory(results[i], named);
      detection.score =
          results[i].contains("score") ? ReadScore(results[i]["score"], "score", named) : 1.0;
      const auto [x, y, width, height] = named.Numbers<4>(named.Member(results[i], "bbox"), "bbox");
      const Box box{x, y, x + width, y + height};
      detection.box =
          CheckedBox(RotatedHull(box, RotationOf(results[i], named), box.Center()), named);
      image.detections.push_back(detection);
    });
  }
  left_out.Check();
  return file;
}

}  // namespace

DetectionFile ReadCoco(const Json& root, const std::string& path) {
  if (root.is_array()) return ReadResults(root, std::nullopt, {}, path);
  const ImageList list = ReadImageList(ListOf(root, "images", path), path);
  return ReadResults(ListOf(root, "annotations", path), list, ReadCategories(root, path), path);
}

}  // namespace oaslam
