#include "oaslam/class_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ranges>
#include <vector>

#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

constexpr std::array kCocoNames = {"person",        "bicycle",      "car",
                                   "motorcycle",    "airplane",     "bus",
                                   "train",         "truck",        "boat",
                                   "traffic light", "fire hydrant", "stop sign",
                                   "parking meter", "bench",        "bird",
                                   "cat",           "dog",          "horse",
                                   "sheep",         "cow",          "elephant",
                                   "bear",          "zebra",        "giraffe",
                                   "backpack",      "umbrella",     "handbag",
                                   "tie",           "suitcase",     "frisbee",
                                   "skis",          "snowboard",    "sports ball",
                                   "kite",          "baseball bat", "baseball glove",
                                   "skateboard",    "surfboard",    "tennis racket",
                                   "bottle",        "wine glass",   "cup",
                                   "fork",          "knife",        "spoon",
                                   "bowl",          "banana",       "apple",
                                   "sandwich",      "orange",       "broccoli",
                                   "carrot",        "hot dog",      "pizza",
                                   "donut",         "cake",         "chair",
                                   "couch",         "potted plant", "bed",
                                   "dining table",  "toilet",       "tv",
                                   "laptop",        "mouse",        "remote",
                                   "keyboard",      "cell phone",   "microwave",
                                   "oven",          "toaster",      "sink",
                                   "refrigerator",  "book",         "clock",
                                   "vase",          "scissors",     "teddy bear",
                                   "hair drier",    "toothbrush"};
static_assert(kCocoNames.size() == 80);

constexpr std::array kKeys = {"names", "parts", "movable"};
// Other keys in data set files of Ultralytics, which contain the names, too.
constexpr std::array kOtherKeys = {"path",     "train",    "val",       "test",    "nc",
                                   "download", "channels", "kpt_shape", "flip_idx"};

void CheckKeys(const YAML::Node& root, const std::string& path) {
  for (const auto& entry : root) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : TextOfNode(entry.first);
    if (std::ranges::find(kKeys, key) == kKeys.end() &&
        std::ranges::find(kOtherKeys, key) == kOtherKeys.end())
      throw BadInput("{}:{}: {}: unknown key, the nearest is {}", path, entry.first.Mark().line + 1,
                     key, NearestOf(kKeys, key));
  }
}

ClassNames ReadNames(const YAML::Node& names, const std::string& path) {
  ClassNames result;
  if (names.IsSequence()) {
    for (size_t i = 0; i < names.size(); ++i) {
      if (!names[i].IsScalar())
        throw BadInput("{}: names[{}]: {}, expected a name", path, i, TextOfNode(names[i]));
      result[static_cast<int>(i)] = names[i].Scalar();
    }
  } else if (names.IsMap()) {
    for (const auto& entry : names) {
      const int id = YamlInteger(entry.first, path, "names", 0, kMaxCategory);
      if (!entry.second.IsScalar())
        throw BadInput("{}: names.{}: {}, expected a name", path, id, TextOfNode(entry.second));
      if (!result.emplace(id, entry.second.Scalar()).second)
        throw BadInput("{}: names.{}: given twice", path, id);
    }
  } else {
    throw BadInput("{}: names: {}, expected {{41: cup}} or [a, b]", path, TextOfNode(names));
  }
  if (result.empty()) throw BadInput("{}: holds no class names", path);
  return result;
}

std::vector<int> CategoriesNamed(const YAML::Node& node, const ClassNames& names,
                                 const std::string& path, const std::string& key) {
  if (!node.IsScalar())
    throw BadInput("{}: {}: {}, expected the name of a class", path, key, TextOfNode(node));
  std::vector<int> categories;
  for (const auto& [id, name] : names)
    if (name == node.Scalar()) categories.push_back(id);
  if (!categories.empty()) return categories;
  throw BadInput("{}: {}: class {} is not known, the nearest is \"{}\"", path, key,
                 TextOfNode(node), NearestOf(std::views::values(names), node.Scalar()));
}

std::map<int, int> ReadParts(const YAML::Node& parts, const ClassNames& names,
                             const std::string& path) {
  std::map<int, int> whole_of;
  if (parts.IsNull()) return whole_of;
  if (!parts.IsMap())
    throw BadInput("{}: parts: {}, expected {{head: statue}}", path, TextOfNode(parts));
  for (const auto& entry : parts) {
    const std::string key =
        "parts." + (entry.first.IsScalar() ? entry.first.Scalar() : TextOfNode(entry.first));
    const std::vector<int> wholes = CategoriesNamed(entry.second, names, path, key);
    if (wholes.size() > 1)
      throw BadInput("{}: {}: several classes are named {}", path, key, TextOfNode(entry.second));
    for (const int part : CategoriesNamed(entry.first, names, path, "parts"))
      if (!whole_of.emplace(part, wholes.front()).second)
        throw BadInput("{}: {}: given twice", path, key);
  }
  if (const auto part = PartOfItself(whole_of))
    throw BadInput("{}: parts: {} is a part of itself", path, names.at(*part));
  return whole_of;
}

std::set<int> ReadMovable(const YAML::Node& movable, const ClassNames& names,
                          const std::string& path) {
  std::set<int> categories;
  if (movable.IsNull()) return categories;
  if (!movable.IsSequence())
    throw BadInput("{}: movable: {}, expected [person, chair]", path, TextOfNode(movable));
  for (const YAML::Node& name : movable)
    for (const int category : CategoriesNamed(name, names, path, "movable"))
      categories.insert(category);
  return categories;
}

Classes FromYaml(const std::string& text, const std::string& path) {
  const YAML::Node root = ParseYamlMapping(text, path);
  CheckKeys(root, path);
  const YAML::Node names = root["names"], parts = root["parts"], movable = root["movable"];
  if (!names && !parts && !movable) throw BadInput("{}: key \"names\" is missing", path);
  Classes classes{names ? ReadNames(names, path) : CocoClassNames(), {}};
  if (parts) classes.relations.whole_of = ReadParts(parts, classes.names, path);
  if (movable) classes.relations.movable = ReadMovable(movable, classes.names, path);
  return classes;
}

bool IsYaml(const std::string& path, const std::string& text) {
  const auto has_key = [&](const std::string& key) {
    return text.starts_with(key + ":") || text.find("\n" + key + ":") != std::string::npos;
  };
  return path.ends_with(".yaml") || path.ends_with(".yml") || std::ranges::any_of(kKeys, has_key);
}

}  // namespace

const ClassNames& CocoClassNames() {
  static const ClassNames names = [] {
    ClassNames result;
    for (size_t i = 0; i < kCocoNames.size(); ++i) result[static_cast<int>(i)] = kCocoNames[i];
    return result;
  }();
  return names;
}

Classes LoadClasses(const std::string& path) {
  const std::string text = ReadTextFile(path);
  if (IsYaml(path, text)) return FromYaml(text, path);
  Classes classes;
  for (const std::string_view line : SplitLines(text))
    if (!Trim(line).empty())
      classes.names[static_cast<int>(classes.names.size())] = std::string(Trim(line));
  if (classes.names.empty()) throw BadInput("{}: holds no class names", path);
  return classes;
}

std::optional<int> PartOfItself(const std::map<int, int>& whole_of) {
  for (const auto& [part, whole] : whole_of) {
    int at = whole;
    for (size_t steps = 0; steps < whole_of.size() && at != part && whole_of.contains(at); ++steps)
      at = whole_of.at(at);
    if (at == part) return part;
  }
  return std::nullopt;
}

std::string NameOf(const ClassNames& names, int category_id) {
  const auto found = names.find(category_id);
  return found != names.end() ? found->second : fmt::format("class {}", category_id);
}

}  // namespace oaslam
