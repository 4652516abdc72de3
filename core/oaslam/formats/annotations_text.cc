#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "oaslam/formats/annotations.h"
#include "oaslam/formats/detection_entry.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// Throws InputError for a detection that cannot be used.
void CheckDetection(const Detection& detection, const std::string& place) {
  if (const std::string problem = ProblemOf(detection); !problem.empty())
    throw BadInput("{}: {}", place, problem);
}

int CategoryOfNumber(double number, const std::string& place) {
  constexpr double kMost = 1e9;  // more is no class, and may be no integer either
  if (!(std::abs(number) <= kMost) || number != std::floor(number))
    throw BadInput("{}: class {}, expected a whole number", place, number);
  if (const std::string problem = ProblemOfCategory(static_cast<int64_t>(number)); !problem.empty())
    throw BadInput("{}: class: {}", place, problem);
  return static_cast<int>(number);
}

// A line of YOLO's text: class, box, and what detectors add: a score, the number of a track, or
// both.
struct YoloLine {
  Detection detection;
  std::optional<double> sixth;  // a score or the number of a track
};

YoloLine ReadYoloLine(const std::vector<std::string_view>& fields, const std::string& place) {
  constexpr size_t kMost = 7;
  if (fields.size() < 5 || fields.size() > kMost)
    throw BadInput(
        "{}: {} numbers, expected YOLO's \"class cx cy width height [score [track]]\"; polygons, "
        "rotated boxes and key points are not read: export boxes, or COCO",
        place, fields.size());
  std::array<double, kMost> v{};
  for (size_t i = 0; i < fields.size(); ++i) {
    const auto number = ParseNumber(fields[i]);
    if (!number) throw BadInput("{}: {}, expected a number", place, Quoted(fields[i]));
    v[i] = *number;
  }
  constexpr double kMostShare = 1.5;  // a box may reach beyond the image
  if (std::ranges::any_of(v.begin() + 1, v.begin() + 5,
                          [](double share) { return !(std::abs(share) <= kMostShare); }))
    throw BadInput("{}: {} {} {} {}, expected shares of the image's width and height", place, v[1],
                   v[2], v[3], v[4]);
  if (fields.size() == kMost && (v[6] < 1 || v[6] != std::floor(v[6])))
    throw BadInput("{}: column 7: {}, expected the number of a track; polygons are not read", place,
                   v[6]);
  YoloLine line;
  line.detection = {.category_id = CategoryOfNumber(v[0], place),
                    .score = 1,
                    .box = {v[1] - v[3] / 2, v[2] - v[4] / 2, v[1] + v[3] / 2, v[2] + v[4] / 2}};
  CheckDetection(line.detection, place);
  if (fields.size() > 5) line.sixth = v[5];
  return line;
}

ClassNames ReadYoloClasses(const std::string& path) {
  ClassNames names;
  const std::string text = ReadTextFile(path);
  for (const std::string_view line : SplitLines(text))
    if (!Trim(line).empty()) names[static_cast<int>(names.size())] = std::string(Trim(line));
  return names;
}

bool IsListOfClasses(const std::string& name) {
  const std::string lower = Lower(name);
  return lower == "classes.txt" || lower == "labels.txt";
}

DetectionFile ReadYolo(const std::vector<std::string>& files, const std::string& folder) {
  DetectionFile result;
  result.in_shares = true;
  LeftOut left_out;
  std::vector<std::optional<double>> sixths;
  for (const std::string& name : files) {
    const std::string path = (fs::path(folder) / name).string();
    if (IsListOfClasses(name)) {
      result.categories = ReadYoloClasses(path);
      continue;
    }
    ImageDetections& image = result.images.emplace_back();
    image.file_name = WithoutExtension(name);
    const std::string text = ReadTextFile(path);
    size_t number = 0;
    for (const std::string_view raw : SplitLines(text)) {
      ++number;
      const auto fields = SplitFields(raw);
      if (fields.empty()) continue;
      left_out.Try([&] {
        const YoloLine line = ReadYoloLine(fields, fmt::format("{}:{}", path, number));
        image.detections.push_back(line.detection);
        sixths.push_back(line.sixth);
      });
    }
  }
  left_out.Check();
  // Where one is no score, all are numbers of tracks.
  const bool are_scores = std::ranges::all_of(
      sixths, [](const auto& sixth) { return !sixth || (*sixth >= 0 && *sixth <= 1); });
  size_t i = 0;
  for (ImageDetections& image : result.images)
    for (Detection& detection : image.detections)
      if (const auto sixth = sixths[i++]; sixth && are_scores) detection.score = *sixth;
  return result;
}

DetectionFile ReadLabelmeFiles(const std::vector<std::string>& files, const std::string& folder) {
  DetectionFile result;
  ClassNumbers classes;
  for (const std::string& name : files) {
    const std::string path = (fs::path(folder) / name).string();
    const nlohmann::json root = ParseDetections(path);
    if (!IsLabelme(root)) throw BadInput("{}: is not of labelme (key shapes)", path);
    DetectionFile one = ReadLabelme(root, path);
    for (ImageDetections& image : one.images) {
      for (Detection& detection : image.detections)
        detection.category_id = classes.Of(one.categories.at(detection.category_id));
      result.images.push_back(std::move(image));
    }
  }
  result.categories = classes.names();
  return result;
}

// A table of text with a header of names.
struct BoxTable {
  std::string path;
  std::vector<std::string> header;  // in lower case

  // The first of the columns that is there.
  std::optional<size_t> Find(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (const auto found = std::ranges::find(header, name); found != header.end())
        return static_cast<size_t>(found - header.begin());
    return std::nullopt;
  }
};

std::string_view Unquoted(std::string_view field) {
  const bool is_quoted = field.size() > 1 && field.starts_with('"') && field.ends_with('"');
  return is_quoted ? field.substr(1, field.size() - 2) : field;
}

struct BoxColumns {
  size_t image, label;
  std::array<size_t, 4> box;
  std::optional<size_t> score;
};

BoxColumns BoxColumnsOf(const BoxTable& table, std::string_view header) {
  const auto image =
      table.Find({"filename", "file_name", "image", "image_name", "image_path", "path", "img"});
  const auto label =
      table.Find({"class_name", "label", "name", "class", "category", "category_id", "class_id"});
  const std::array box = {table.Find({"xmin", "x_min", "x1"}), table.Find({"ymin", "y_min", "y1"}),
                          table.Find({"xmax", "x_max", "x2"}), table.Find({"ymax", "y_max", "y2"})};
  if (!image || !label || !std::ranges::all_of(box, [](const auto& c) { return c.has_value(); }))
    throw BadInput(
        "{}:1: {}, expected a header with the columns filename, class, xmin, ymin, xmax, ymax and, "
        "if there are scores, score; other tables: convert them to it",
        table.path, Quoted(header));
  return {*image,
          *label,
          {*box[0], *box[1], *box[2], *box[3]},
          table.Find({"score", "confidence", "conf"})};
}

}  // namespace

int ClassNumbers::Of(const std::string& name) {
  return numbers_.emplace(name, static_cast<int>(numbers_.size())).first->second;
}

ClassNames ClassNumbers::names() const {
  ClassNames names;
  for (const auto& [name, number] : numbers_) names[number] = name;
  return names;
}

DetectionFile ReadDetectionCsv(const std::string& path) {
  const std::string text = ReadTextFile(path);
  const auto lines = SplitLines(text);
  BoxTable table{path, {}};
  if (lines.empty()) throw BadInput("{}: is empty", path);
  for (const std::string_view name : SplitCommas(lines[0]))
    table.header.push_back(Lower(Unquoted(name)));
  const BoxColumns columns = BoxColumnsOf(table, lines[0]);
  std::vector<std::pair<size_t, std::vector<std::string_view>>> rows;
  for (size_t i = 1; i < lines.size(); ++i) {
    if (Trim(lines[i]).empty()) continue;
    auto fields = SplitCommas(lines[i]);
    if (fields.size() != table.header.size())
      throw BadInput("{}:{}: {} columns, but {} in its header", path, i + 1, fields.size(),
                     table.header.size());
    for (std::string_view& field : fields) field = Unquoted(field);
    rows.emplace_back(i + 1, std::move(fields));
  }
  const bool are_numbers = std::ranges::all_of(
      rows, [&](const auto& row) { return ParseNumber(row.second[columns.label]).has_value(); });
  DetectionFile file;
  ClassNumbers classes;
  std::map<std::string, size_t> index;
  LeftOut left_out;
  for (const auto& [line, fields] : rows) {
    const std::string name(fields[columns.image]);
    if (const auto [found, is_new] = index.emplace(name, file.images.size()); is_new)
      file.images.push_back({name, {}});
    left_out.Try([&, line = line, &fields = fields] {
      const std::string place = fmt::format("{}:{}", path, line);
      const auto number = [&](size_t column) { return NumberAt(fields, column, path, line); };
      const std::array<size_t, 4>& box = columns.box;
      Detection detection{.category_id = are_numbers
                                             ? CategoryOfNumber(number(columns.label), place)
                                             : classes.Of(std::string(fields[columns.label])),
                          .score = columns.score ? number(*columns.score) : 1,
                          .box = {number(box[0]), number(box[1]), number(box[2]), number(box[3])}};
      CheckDetection(detection, place);
      file.images[index.at(name)].detections.push_back(std::move(detection));
    });
  }
  left_out.Check();
  if (!are_numbers) file.categories = classes.names();
  return file;
}

DetectionFile ReadDetectionFolder(const std::string& path) {
  // The results of a detector have them in a folder of their own.
  std::error_code error;
  const std::string labels = (fs::path(path) / "labels").string();
  const std::string folder = fs::is_directory(labels, error) ? labels : path;
  std::vector<std::string> texts, jsons;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.')) continue;
    if (LowerExtension(name) == ".txt") texts.push_back(name);
    if (LowerExtension(name) == ".json") jsons.push_back(name);
  }
  if (error) throw BadInput("{}: {}", folder, error.message());
  std::ranges::sort(texts);
  std::ranges::sort(jsons);
  if (!std::ranges::all_of(texts, IsListOfClasses)) return ReadYolo(texts, folder);
  if (!jsons.empty()) return ReadLabelmeFiles(jsons, folder);
  throw BadInput(
      "{}: has no boxes: read are YOLO's texts (.txt) and labelme's files (.json), one for each "
      "image; XML (CVAT, Pascal VOC): export COCO's JSON",
      path);
}

}  // namespace oaslam
