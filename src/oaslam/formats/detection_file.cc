#include "oaslam/detection_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <unordered_map>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/formats/detection_input.h"
#include "oaslam/formats/detection_json.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/util/log.h"
#include "oaslam/util/printable.h"

namespace oaslam {
namespace {

using Json = nlohmann::json;

// JSON has no NaN and no Infinity, but Python writes them: null outside of strings, which no box
// may have either.
std::string WithoutNan(const std::string& text) {
  std::string result;
  bool is_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') is_string = !is_string;
    const std::string_view rest = std::string_view(text).substr(i);
    const size_t length = is_string                       ? 0
                          : rest.starts_with("NaN")       ? 3
                          : rest.starts_with("Infinity")  ? 8
                          : rest.starts_with("-Infinity") ? 9
                                                          : 0;
    if (length > 0) {
      result += "null";
      i += length - 1;
      continue;
    }
    result += text[i];
    if (is_string && text[i] == '\\' && i + 1 < text.size()) result += text[++i];
  }
  return result;
}

Json ParseJson(const std::string& path) {
  const std::string text = ReadTextFile(path);
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_discarded()) return json;
  try {
    return Json::parse(WithoutNan(text));
  } catch (const Json::exception& error) {
    throw InputError(
        fmt::format("{}: malformed JSON: {}", path, OnOneLine(Printable(error.what()), 200)));
  }
}

// Boxes that cannot be used: a few are left out, more of them tell that a file is not what it is
// taken for.
class LeftOut {
 public:
  // Calls `read`; false where it refused a box.
  bool Try(const std::function<void()>& read) {
    ++total_;
    try {
      read();
      return true;
    } catch (const InputError& error) {
      if (++count_ == 1) first_ = error.what();
      return false;
    }
  }
  // Throws InputError where too many were refused, and warns of a few.
  void Check() const {
    constexpr int kFew = 4;  // one of so many
    if (count_ == 0) return;
    if (count_ == total_ || count_ > std::max(1, total_ / kFew))
      throw InputError(
          total_ == 1 ? first_
                      : fmt::format("{} (the first of {} bad ones of {})", first_, count_, total_));
    Log(LogLevel::kWarning, fmt::format("{}; left out, as {} of {} boxes", first_, count_, total_));
  }

 private:
  int count_ = 0, total_ = 0;
  std::string first_;
};

// The place of a value in the file, for messages.
struct Place {
  const std::string& path;
  std::string entry;

  [[noreturn]] void Refuse(const std::string& problem) const {
    constexpr size_t kMaxBytes = 200;  // a value may be long
    throw InputError(fmt::format("{}: {}: {}", path, entry, OnOneLine(problem, kMaxBytes)));
  }
  // Throws if there is a problem with the value of this key.
  void RefuseIf(const std::string& problem, const char* key) const {
    if (!problem.empty()) Refuse(fmt::format("{}: {}", key, problem));
  }
  const Json& Member(const Json& object, const char* key) const {
    if (!object.is_object()) Refuse(fmt::format("{}, expected an object", JsonText(object)));
    const auto found = object.find(key);
    if (found == object.end()) Refuse(fmt::format("key \"{}\" is missing", key));
    return *found;
  }
  bool Has(const Json& object, const char* key) const {
    return object.is_object() && object.contains(key);
  }
  double Number(const Json& value, const char* key) const {
    if (!value.is_number()) Refuse(fmt::format("{}: {}, expected a number", key, JsonText(value)));
    const double number = value.get<double>();
    if (!std::isfinite(number)) Refuse(fmt::format("{}: not finite", key));
    return number;
  }
  template <size_t N>
  std::array<double, N> Numbers(const Json& value, const char* key) const {
    if (!value.is_array() || value.size() != N)
      Refuse(fmt::format("{}: {}, expected {} numbers", key, JsonText(value), N));
    std::array<double, N> numbers{};
    for (size_t i = 0; i < N; ++i) numbers[i] = Number(value[i], key);
    return numbers;
  }
};

int CategoryOf(const Json& id, const char* key, const Place& place) {
  if (!id.is_number_integer())
    place.Refuse(fmt::format("{}: {}, expected a whole number", key, JsonText(id)));
  place.RefuseIf(ProblemOfCategory(id.get<int64_t>()), key);
  return id.get<int>();
}

int ReadCategory(const Json& entry, const Place& place) {
  return CategoryOf(place.Member(entry, "category_id"), "category_id", place);
}

double ReadScore(const Json& score, const char* key, const Place& place) {
  const double value = place.Number(score, key);
  place.RefuseIf(ProblemOfScore(value), key);
  return value;
}

Box CheckedBox(const Box& box, const Place& place) {
  place.RefuseIf(ProblemOfBox(box), "bbox");
  return box;
}

// Reads [[category_id, score], ...]; returns the best first, and equal ones in the order of the
// file.
std::vector<Label> ReadLabels(const Json& entry, const Place& place) {
  const Json& list = entry["labels"];
  if (!list.is_array() || list.empty())
    place.Refuse(
        fmt::format("labels: {}, expected a list of [category_id, score]", JsonText(list)));
  std::vector<Label> labels;
  for (const Json& pair : list) {
    if (!pair.is_array() || pair.size() != 2)
      place.Refuse(fmt::format("labels: {}, expected [category_id, score]", JsonText(pair)));
    labels.push_back({CategoryOf(pair[0], "labels", place), ReadScore(pair[1], "labels", place)});
  }
  place.RefuseIf(ProblemOfLabels(labels), "labels");
  std::ranges::stable_sort(labels, std::greater(), &Label::score);
  if (!(labels.front().score > 0))
    place.Refuse(fmt::format("labels: {}, expected a score above 0", JsonText(list)));
  return labels;
}

// Where there are labels, the best gives class and score; a "detection_score" beside them scales
// all.
void ReadClassAndScore(const Json& entry, const Place& place, Detection& detection) {
  if (!place.Has(entry, "labels")) {
    detection.category_id = ReadCategory(entry, place);
    detection.score = ReadScore(place.Member(entry, "detection_score"), "detection_score", place);
    return;
  }
  std::vector<Label> labels = ReadLabels(entry, place);
  const Label best = labels.front();
  detection.category_id = best.category_id;
  if (entry.contains("category_id") && ReadCategory(entry, place) != best.category_id)
    place.Refuse(fmt::format("category_id: {}, but the best of its labels is {}",
                             JsonText(entry["category_id"]), best.category_id));
  detection.score = entry.contains("detection_score")
                        ? ReadScore(entry["detection_score"], "detection_score", place)
                        : best.score;
  for (size_t i = 1; i < labels.size(); ++i)
    detection.other_labels.push_back(
        {labels[i].category_id, labels[i].score * detection.score / best.score});
}

Detection ReadOwnDetection(const Json& entry, const Place& place) {
  Detection detection;
  ReadClassAndScore(entry, place, detection);
  const auto [x1, y1, x2, y2] = place.Numbers<4>(place.Member(entry, "bbox"), "bbox");
  detection.box = CheckedBox({x1, y1, x2, y2}, place);
  if (entry.contains("ellipse")) {
    detection.ellipse = place.Numbers<5>(entry["ellipse"], "ellipse");
    place.RefuseIf(ProblemOfEllipse(*detection.ellipse), "ellipse");
  }
  return detection;
}

// [{"file_name": ..., "detections": [...]}]
std::vector<ImageDetections> ReadOwn(const Json& root, const std::string& path) {
  std::vector<ImageDetections> images;
  LeftOut left_out;
  for (size_t i = 0; i < root.size(); ++i) {
    const Place image_place{path, fmt::format("entry {}", i)};
    const Json& name = image_place.Member(root[i], "file_name");
    if (!name.is_string() || BaseName(name.get<std::string>()).empty())
      image_place.Refuse(fmt::format("file_name: {}, expected a name", JsonText(name)));
    ImageDetections image{name.get<std::string>(), {}};
    const Json& detections = image_place.Member(root[i], "detections");
    if (!detections.is_array())
      image_place.Refuse(fmt::format("detections: {}, expected a list", detections.type_name()));
    for (size_t k = 0; k < detections.size(); ++k)
      left_out.Try([&] {
        image.detections.push_back(ReadOwnDetection(
            detections[k], {path, fmt::format("{}, detection {}", image.file_name, k)}));
      });
    images.push_back(std::move(image));
  }
  left_out.Check();
  return images;
}

using ImageList = std::map<int64_t, std::string>;

const Json& ListOf(const Json& root, const char* key, const std::string& path) {
  const Place place{path, "file"};
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
    const Place place{path, fmt::format("categories[{}]", i)};
    const Json& name = place.Member(categories[i], "name");
    if (!name.is_string()) place.Refuse(fmt::format("name: {}, expected a name", JsonText(name)));
    names[CategoryOf(place.Member(categories[i], "id"), "id", place)] = name.get<std::string>();
  }
  return names;
}

ImageList ReadImageList(const Json& images, const std::string& path) {
  ImageList list;
  for (size_t i = 0; i < images.size(); ++i) {
    const Place place{path, fmt::format("images[{}]", i)};
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
    const Json root = ParseJson(candidate);
    categories = ReadCategories(root, candidate);
    return ReadImageList(root.is_array() ? root : ListOf(root, "images", candidate), candidate);
  }
  return std::nullopt;
}

// The name of the image of a result: "file_name", as Ultralytics writes it, "image_id", or what the
// list says of that number; the number itself where there is no list.
std::string NameOfImage(const Json& result, const std::optional<ImageList>& list,
                        const Place& place) {
  const Json& id = place.Member(result, "image_id");
  if (result.contains("file_name") && result["file_name"].is_string())
    return result["file_name"].get<std::string>();
  if (id.is_string()) return id.get<std::string>();
  if (id.is_number_integer() && !list) return std::to_string(id.get<int64_t>());
  if (!id.is_number_integer() || !list->contains(id.get<int64_t>()))
    place.Refuse(fmt::format("image_id: {} is not in the image list", JsonText(id)));
  return list->at(id.get<int64_t>());
}

DetectionFile ReadCoco(const Json& results, std::optional<ImageList> list, ClassNames categories,
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
    const Place place{path, fmt::format("entry {}", i)};
    const std::string name = NameOfImage(results[i], list, place);
    ImageDetections& image = image_of(name);
    left_out.Try([&] {
      const Place named{path, fmt::format("entry {} ({})", i, name)};
      Detection detection;
      detection.category_id = ReadCategory(results[i], named);
      detection.score =
          results[i].contains("score") ? ReadScore(results[i]["score"], "score", named) : 1.0;
      const auto [x, y, width, height] = named.Numbers<4>(named.Member(results[i], "bbox"), "bbox");
      detection.box = CheckedBox({x, y, x + width, y + height}, named);
      image.detections.push_back(detection);
    });
  }
  left_out.Check();
  return file;
}

DetectionFile ReadAny(const Json& root, const std::string& path) {
  if (root.is_object()) {
    const ImageList list = ReadImageList(ListOf(root, "images", path), path);
    return ReadCoco(ListOf(root, "annotations", path), list, ReadCategories(root, path), path);
  }
  if (!root.is_array())
    throw InputError(fmt::format("{}: expected a list of images with detections", path));
  if (!root.empty() && root[0].is_object() && root[0].contains("image_id"))
    return ReadCoco(root, std::nullopt, {}, path);
  return {ReadOwn(root, path)};
}

}  // namespace

std::vector<Detection> DetectionsFromJson(const Json& list, const std::string& where) {
  if (!list.is_array()) throw InputError(fmt::format("{}: expected a list of detections", where));
  std::vector<Detection> detections;
  for (size_t i = 0; i < list.size(); ++i)
    detections.push_back(ReadOwnDetection(list[i], {where, fmt::format("detection {}", i)}));
  return detections;
}

struct OASLAM_LOCAL DetectionTable::Content {
  explicit Content(std::vector<ImageDetections> all) : images(std::move(all)) {
    for (size_t i = 0; i < images.size(); ++i) {
      const std::string name = BaseName(images[i].file_name);
      by_name.emplace(name, i);
      by_stem.emplace(WithoutExtension(name), i);
    }
  }
  std::vector<ImageDetections> images;
  std::unordered_map<std::string, size_t> by_name, by_stem;
};

DetectionTable::DetectionTable(std::vector<ImageDetections> images)
    : content_(std::make_shared<const Content>(std::move(images))) {}
DetectionTable::DetectionTable() : DetectionTable(std::vector<ImageDetections>()) {}

const std::vector<ImageDetections>& DetectionTable::images() const { return content_->images; }

const std::vector<Detection>& DetectionTable::Find(const std::string& image_name) const {
  static const std::vector<Detection> none;
  const std::string name = BaseName(image_name);
  const Content& content = *content_;
  if (const auto found = content.by_name.find(name); found != content.by_name.end())
    return content.images[found->second].detections;
  const auto found = content.by_stem.find(WithoutExtension(name));
  return found != content.by_stem.end() ? content.images[found->second].detections : none;
}

DetectionFile ReadDetectionFile(const std::string& path) {
  DetectionFile file = ReadAny(ParseJson(path), path);
  std::map<std::string, std::string> seen;
  for (const ImageDetections& image : file.images) {
    const auto [other, is_new] = seen.emplace(BaseName(image.file_name), image.file_name);
    if (!is_new)
      throw InputError(fmt::format("{}: {}: the base name is that of {}, too", path,
                                   image.file_name, other->second));
  }
  return file;
}

void CheckNames(const DetectionFile& file, const std::string& path) {
  if (file.has_numbers_for_names)
    throw InputError(
        fmt::format("{}: names images by number; put their list {{\"images\": [{{\"id\", "
                    "\"file_name\"}}]}} beside it as {}.images.json",
                    path, std::filesystem::path(path).stem().string()));
}

DetectionTable LoadDetections(const std::string& path) {
  DetectionFile file = ReadDetectionFile(path);
  CheckNames(file, path);
  return DetectionTable(std::move(file.images));
}

namespace {

// Of a score, or of a pixel.
double FourPlaces(double x) { return std::round(x * 1e4) / 1e4; }
double TwoPlaces(double px) { return std::round(px * 100) / 100; }

nlohmann::ordered_json JsonOf(const Detection& d) {
  const Box& b = d.box;
  nlohmann::ordered_json json{
      {"category_id", d.category_id},
      {"detection_score", FourPlaces(d.score)},
      {"bbox", {TwoPlaces(b.x1), TwoPlaces(b.y1), TwoPlaces(b.x2), TwoPlaces(b.y2)}}};
  // A score that is rounded to 0 cannot be shared.
  if (!d.other_labels.empty() && d.score >= 0.5e-4) {
    json["labels"].push_back({d.category_id, FourPlaces(d.score)});
    for (const Label& label : d.other_labels)
      json["labels"].push_back({label.category_id, FourPlaces(label.score)});
  }
  if (d.ellipse) {
    const auto& e = *d.ellipse;
    json["ellipse"] = {TwoPlaces(e[0]), TwoPlaces(e[1]), TwoPlaces(e[2]), TwoPlaces(e[3]),
                       std::round(e[4] * 1e6) / 1e6};
  }
  return json;
}

}  // namespace

void SaveDetections(const std::string& path, const std::vector<ImageDetections>& images) {
  std::string text = "[";  // a line for each image
  for (const ImageDetections& image : images) {
    nlohmann::ordered_json line{{"file_name", image.file_name},
                                {"detections", nlohmann::ordered_json::array()}};
    for (const Detection& d : image.detections) {
      if (!std::isfinite(d.score + d.box.x1 + d.box.y1 + d.box.x2 + d.box.y2))
        throw InputError(fmt::format("{}: {}: detection {} has a number that is not finite", path,
                                     image.file_name, &d - image.detections.data()));
      line["detections"].push_back(JsonOf(d));
    }
    text += (&image == &images.front() ? "\n" : ",\n") + JsonText(line);
  }
  WriteTextFile(path, text + "\n]\n");
}

}  // namespace oaslam
