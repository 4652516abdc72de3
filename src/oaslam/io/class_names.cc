#include "oaslam/io/class_names.h"

#include <fmt/format.h>

#include <array>

#include "oaslam/error.h"
#include "oaslam/io/text.h"
#include "oaslam/io/yaml.h"

namespace oaslam {
namespace {

constexpr std::array kCocoNames = {
    "person",        "bicycle",      "car",           "motorcycle",    "airplane",     "bus",           "train",
    "truck",         "boat",         "traffic light", "fire hydrant",  "stop sign",    "parking meter", "bench",
    "bird",          "cat",          "dog",           "horse",         "sheep",        "cow",           "elephant",
    "bear",          "zebra",        "giraffe",       "backpack",      "umbrella",     "handbag",       "tie",
    "suitcase",      "frisbee",      "skis",          "snowboard",     "sports ball",  "kite",          "baseball bat",
    "baseball glove", "skateboard",  "surfboard",     "tennis racket", "bottle",       "wine glass",    "cup",
    "fork",          "knife",        "spoon",         "bowl",          "banana",       "apple",         "sandwich",
    "orange",        "broccoli",     "carrot",        "hot dog",       "pizza",        "donut",         "cake",
    "chair",         "couch",        "potted plant",  "bed",           "dining table", "toilet",        "tv",
    "laptop",        "mouse",        "remote",        "keyboard",      "cell phone",   "microwave",     "oven",
    "toaster",       "sink",         "refrigerator",  "book",          "clock",        "vase",          "scissors",
    "teddy bear",    "hair drier",   "toothbrush"};
static_assert(kCocoNames.size() == 80);

constexpr int kMaxCategory = 1'000'000;

ClassNames FromYaml(const std::string& path) {
  const YAML::Node names = LoadYamlMapping(path)["names"];
  ClassNames result;
  if (names.IsSequence()) {
    for (size_t i = 0; i < names.size(); ++i) {
      if (!names[i].IsScalar()) throw InputError(fmt::format("{}: names[{}]: {}, expected a name", path, i, Show(names[i])));
      result[static_cast<int>(i)] = names[i].Scalar();
    }
  } else if (names.IsMap()) {
    for (const auto& entry : names) {
      const int id = YamlInteger(entry.first, path, "names", 0, kMaxCategory);
      if (!entry.second.IsScalar())
        throw InputError(fmt::format("{}: names.{}: {}, expected a name", path, id, Show(entry.second)));
      if (!result.emplace(id, entry.second.Scalar()).second)
        throw InputError(fmt::format("{}: names.{}: given twice", path, id));
    }
  } else {
    throw InputError(fmt::format("{}: names: {}, expected {{41: cup}} or [a, b]", path, Show(names)));
  }
  return result;
}

bool HasNamesKey(const std::string& text) { return text.starts_with("names:") || text.find("\nnames:") != std::string::npos; }

}  // namespace

const ClassNames& CocoClassNames() {
  static const ClassNames names = [] {
    ClassNames result;
    for (size_t i = 0; i < kCocoNames.size(); ++i) result[static_cast<int>(i)] = kCocoNames[i];
    return result;
  }();
  return names;
}

ClassNames LoadClassNames(const std::string& path) {
  const std::string text = ReadTextFile(path);
  ClassNames result;
  if (HasNamesKey(text)) {
    result = FromYaml(path);
  } else if (path.ends_with(".yaml") || path.ends_with(".yml")) {
    throw InputError(fmt::format("{}: key \"names\" is missing", path));
  } else {
    for (const std::string_view line : SplitLines(text))
      if (!Trim(line).empty()) result[static_cast<int>(result.size())] = std::string(Trim(line));
  }
  if (result.empty()) throw InputError(fmt::format("{}: holds no class names", path));
  return result;
}

std::string NameOf(const ClassNames& names, int category_id) {
  const auto found = names.find(category_id);
  return found != names.end() ? found->second : fmt::format("class {}", category_id);
}

}  // namespace oaslam
