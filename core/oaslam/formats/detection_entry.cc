#include "oaslam/formats/detection_entry.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "oaslam/formats/detection_json.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/util/bad_input.h"
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

// Reads [[category_id, score], ...]; returns the best first, and equal ones in the order of the
// file.
std::vector<Label> ReadLabels(const Json& entry, const JsonPlace& place) {
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
void ReadClassAndScore(const Json& entry, const JsonPlace& place, Detection& detection) {
  if (!entry.is_object() || !entry.contains("labels")) {
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

}  // namespace

Json ParseDetections(const std::string& path) {
  const std::string text = ReadTextFile(path);
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_discarded()) return json;
  try {
    return Json::parse(WithoutNan(text));
  } catch (const Json::exception& error) {
    throw BadInput("{}: malformed JSON: {}", path, OnOneLine(Printable(error.what()), 200));
  }
}

bool LeftOut::Try(const std::function<void()>& read) {
  ++total_;
  try {
    read();
    return true;
  } catch (const InputError& error) {
    if (++count_ == 1) first_ = error.what();
    return false;
  }
}

void LeftOut::Check() const {
  constexpr int kFew = 4;  // one of so many
  if (count_ == 0) return;
  if (count_ == total_ || count_ > std::max(1, total_ / kFew))
    throw InputError(
        total_ == 1 ? first_
                    : fmt::format("{} (the first of {} bad ones of {})", first_, count_, total_));
  Log(LogLevel::kWarning, "{}; left out, as {} of {} boxes", first_, count_, total_);
}

void JsonPlace::Refuse(const std::string& problem) const {
  constexpr size_t kMaxBytes = 200;  // a value may be long
  throw BadInput("{}: {}: {}", path, entry, OnOneLine(problem, kMaxBytes));
}

void JsonPlace::RefuseIf(const std::string& problem, const char* key) const {
  if (!problem.empty()) Refuse(fmt::format("{}: {}", key, problem));
}

const Json& JsonPlace::Member(const Json& object, const char* key) const {
  if (!object.is_object()) Refuse(fmt::format("{}, expected an object", JsonText(object)));
  const auto found = object.find(key);
  if (found == object.end()) Refuse(fmt::format("key \"{}\" is missing", key));
  return *found;
}

double JsonPlace::Number(const Json& value, const char* key) const {
  if (!value.is_number()) Refuse(fmt::format("{}: {}, expected a number", key, JsonText(value)));
  const double number = value.get<double>();
  if (!std::isfinite(number)) Refuse(fmt::format("{}: not finite", key));
  return number;
}

int CategoryOf(const Json& id, const char* key, const JsonPlace& place) {
  if (!id.is_number_integer())
    place.Refuse(fmt::format("{}: {}, expected a whole number", key, JsonText(id)));
  place.RefuseIf(ProblemOfCategory(id.get<int64_t>()), key);
  return id.get<int>();
}

int ReadCategory(const Json& entry, const JsonPlace& place) {
  return CategoryOf(place.Member(entry, "category_id"), "category_id", place);
}

double ReadScore(const Json& score, const char* key, const JsonPlace& place) {
  const double value = place.Number(score, key);
  place.RefuseIf(ProblemOfScore(value), key);
  return value;
}

Box CheckedBox(const Box& box, const JsonPlace& place) {
  place.RefuseIf(ProblemOfBox(box), "bbox");
  return box;
}

Detection ReadDetection(const Json& entry, const JsonPlace& place) {
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

std::vector<Detection> DetectionsFromJson(const Json& list, const std::string& where) {
  if (!list.is_array()) throw BadInput("{}: expected a list of detections", where);
  std::vector<Detection> detections;
  for (size_t i = 0; i < list.size(); ++i)
    detections.push_back(ReadDetection(list[i], {where, fmt::format("detection {}", i)}));
  return detections;
}

}  // namespace oaslam
