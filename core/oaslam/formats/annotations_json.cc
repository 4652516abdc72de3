#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "oaslam/formats/annotations.h"
#include "oaslam/formats/detection_entry.h"
#include "oaslam/formats/rotated_box.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/log.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

using Json = nlohmann::json;

std::string TextAt(const Json& object, const char* key, const JsonPlace& place) {
  const Json& text = place.Member(object, key);
  if (!text.is_string()) place.Refuse(fmt::format("{}: {}, expected a name", key, JsonText(text)));
  return text.get<std::string>();
}

// A score, which labels by hand do not have.
double ScoreOf(const Json& object, const JsonPlace& place) {
  const auto score = object.find("score");
  return score == object.end() || score->is_null() ? 1 : ReadScore(*score, "score", place);
}

// Areas that are read as boxes; others, such as lines and points, are counted.
class Areas {
 public:
  explicit Areas(const std::string& path) : path_(path) {}
  void Skip() { ++skipped_; }
  void Say() const {
    if (skipped_ > 0)
      Log(LogLevel::kInfo, "{}: {} shapes that are no boxes, polygons or circles are left out",
          path_, skipped_);
  }

 private:
  const std::string& path_;
  int skipped_ = 0;
};

std::vector<Eigen::Vector2d> PointsOf(const Json& list, const JsonPlace& place) {
  if (!list.is_array() || list.size() < 2)
    place.Refuse(fmt::format("points: {}, expected [[x, y], ...]", JsonText(list)));
  std::vector<Eigen::Vector2d> points;
  for (const Json& point : list) {
    const auto [x, y] = place.Numbers<2>(point, "points");
    points.emplace_back(x, y);
  }
  return points;
}

// The box of a shape of labelme; nothing for a line or a point.
std::optional<Box> BoxOfShape(const Json& shape, const JsonPlace& place) {
  const std::string kind =
      shape.contains("shape_type") ? TextAt(shape, "shape_type", place) : "polygon";
  if (kind != "rectangle" && kind != "polygon" && kind != "circle" && kind != "rotation")
    return std::nullopt;
  auto points = PointsOf(place.Member(shape, "points"), place);
  if (kind == "circle") {  // its centre, and a point on it
    const Eigen::Vector2d center = points[0],
                          radius = Eigen::Vector2d::Constant((points[1] - center).norm());
    points = {center - radius, center + radius};
  }
  return CheckedBox(HullOf(points), place);
}

// A task of Label Studio, or one of its short form.
const Json* ResultsOf(const Json& task) {
  if (const auto label = task.find("label"); label != task.end()) return &*label;
  const auto annotations = task.find("annotations");
  if (annotations == task.end() || !annotations->is_array()) return nullptr;
  for (const Json& annotation : *annotations) {
    const bool is_cancelled = annotation.is_object() && annotation.contains("was_cancelled") &&
                              annotation["was_cancelled"] == true;
    if (annotation.is_object() && annotation.contains("result") && !is_cancelled)
      return &annotation["result"];
  }
  return nullptr;
}

// "000012.png" of "/data/upload/3/1a2b3c4d-000012.png" or "/data/local-files/?d=film/000012.png".
std::string NameOfUpload(const std::string& address) {
  std::string name = BaseName(DecodePercent(address).value_or(address));
  if (const size_t mark = name.rfind("?d="); mark != std::string::npos)
    name = name.substr(mark + 3);
  constexpr size_t kPrefix = 8;  // of an upload
  const bool has_prefix = name.size() > kPrefix + 1 && name[kPrefix] == '-' &&
                          name.find_first_not_of("0123456789abcdef") == kPrefix;
  return has_prefix ? name.substr(kPrefix + 1) : name;
}

std::string NameOfTask(const Json& task, const JsonPlace& place) {
  const Json& data = task.contains("data") ? task["data"] : task;
  for (const char* key : {"image", "img", "photo"})
    if (data.is_object() && data.contains(key) && data[key].is_string())
      return NameOfUpload(data[key].get<std::string>());
  place.Refuse("key \"image\" is missing");
}

struct LabelledBox {
  std::string label;
  Box box;
};

// The box of a result of Label Studio, whose numbers are percents of the image's sides; nothing for
// another kind.
std::optional<LabelledBox> BoxOfResult(const Json& result, const JsonPlace& place) {
  const Json& value = result.contains("value") ? place.Member(result, "value") : result;
  const char* kind = value.contains("rectanglelabels") ? "rectanglelabels"
                     : value.contains("polygonlabels") ? "polygonlabels"
                                                       : nullptr;
  if (!kind) return std::nullopt;
  const Json& labels = value[kind];
  if (!labels.is_array() || labels.empty() || !labels[0].is_string())
    place.Refuse(fmt::format("{}: {}, expected a list of names", kind, JsonText(labels)));
  const auto number = [&](const Json& object, const char* key) {
    return place.Number(place.Member(object, key), key);
  };
  const double x_px = number(result, "original_width") / 100,
               y_px = number(result, "original_height") / 100;
  Box box;
  if (kind == std::string("polygonlabels")) {
    auto points = PointsOf(place.Member(value, "points"), place);
    for (Eigen::Vector2d& point : points) point = point.cwiseProduct(Eigen::Vector2d(x_px, y_px));
    box = HullOf(points);
  } else {
    const double x = x_px * number(value, "x"), y = y_px * number(value, "y");
    const Box upright{x, y, x + x_px * number(value, "width"), y + y_px * number(value, "height")};
    const double rotation = value.contains("rotation") ? number(value, "rotation") : 0;
    box = RotatedHull(upright, rotation, {x, y});
  }
  return LabelledBox{labels[0].get<std::string>(), CheckedBox(box, place)};
}

}  // namespace

bool IsLabelme(const Json& root) {
  return root.is_object() && root.contains("shapes") && root["shapes"].is_array();
}

bool IsLabelStudio(const Json& root) {
  if (!root.is_array() || root.empty() || !root[0].is_object()) return false;
  const Json& task = root[0];
  return (task.contains("data") && task.contains("annotations")) ||
         (task.contains("image") && (task.contains("label") || task.contains("annotator")));
}

DetectionFile ReadLabelme(const Json& root, const std::string& path) {
  std::string name = root.contains("imagePath") && root["imagePath"].is_string()
                         ? root["imagePath"].get<std::string>()
                         : BaseName(path);
  std::ranges::replace(name, '\\', '/');
  ImageDetections image{BaseName(name), {}};
  ClassNumbers classes;
  LeftOut left_out;
  Areas areas(path);
  for (const Json& shape : root["shapes"])
    left_out.Try([&] {
      const JsonPlace place{path, fmt::format("shapes[{}]", &shape - &root["shapes"][0])};
      const std::string label = TextAt(shape, "label", place);
      if (const auto box = BoxOfShape(shape, place))
        image.detections.push_back(
            {.category_id = classes.Of(label), .score = ScoreOf(shape, place), .box = *box});
      else
        areas.Skip();
    });
  left_out.Check();
  areas.Say();
  return {{std::move(image)}, classes.names()};
}

DetectionFile ReadLabelStudio(const Json& root, const std::string& path) {
  DetectionFile file;
  ClassNumbers classes;
  LeftOut left_out;
  Areas areas(path);
  for (size_t i = 0; i < root.size(); ++i) {
    const JsonPlace task_place{path, fmt::format("task {}", i)};
    if (!root[i].is_object()) task_place.Refuse("expected an object");
    ImageDetections& image = file.images.emplace_back();
    image.file_name = NameOfTask(root[i], task_place);
    const Json* results = ResultsOf(root[i]);
    for (size_t k = 0; results && results->is_array() && k < results->size(); ++k)
      left_out.Try([&] {
        const JsonPlace place{path, fmt::format("{}, result {}", image.file_name, k)};
        const Json& result = (*results)[k];
        if (!result.is_object()) place.Refuse("expected an object");
        if (const auto found = BoxOfResult(result, place))
          image.detections.push_back({.category_id = classes.Of(found->label),
                                      .score = ScoreOf(result, place),
                                      .box = found->box});
        else
          areas.Skip();
      });
  }
  left_out.Check();
  areas.Say();
  file.categories = classes.names();
  return file;
}

}  // namespace oaslam
