#include "oaslam/detection_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <unordered_map>
#include <utility>

#include "oaslam/formats/annotations.h"
#include "oaslam/formats/coco_detections.h"
#include "oaslam/formats/detection_entry.h"
#include "oaslam/formats/detection_input.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

namespace {

using Json = nlohmann::json;

// [{"file_name": ..., "detections": [...]}]
std::vector<ImageDetections> ReadOwn(const Json& root, const std::string& path) {
  std::vector<ImageDetections> images;
  LeftOut left_out;
  for (size_t i = 0; i < root.size(); ++i) {
    const JsonPlace image_place{path, fmt::format("entry {}", i)};
    const Json& name = image_place.Member(root[i], "file_name");
    if (!name.is_string() || BaseName(name.get<std::string>()).empty())
      image_place.Refuse(fmt::format("file_name: {}, expected a name", JsonText(name)));
    ImageDetections image{name.get<std::string>(), {}};
    const Json& detections = image_place.Member(root[i], "detections");
    if (!detections.is_array())
      image_place.Refuse(fmt::format("detections: {}, expected a list", detections.type_name()));
    for (size_t k = 0; k < detections.size(); ++k)
      left_out.Try([&] {
        image.detections.push_back(ReadDetection(
            detections[k], {path, fmt::format("{}, detection {}", image.file_name, k)}));
      });
    images.push_back(std::move(image));
  }
  left_out.Check();
  return images;
}

DetectionFile ReadJson(const Json& root, const std::string& path) {
  if (IsLabelme(root)) return ReadLabelme(root, path);
  if (IsLabelStudio(root)) return ReadLabelStudio(root, path);
  const bool is_list = root.is_array();
  if (is_list && (root.empty() || !root[0].is_object() || !root[0].contains("image_id")))
    return DetectionFile{ReadOwn(root, path)};
  if (!is_list && !(root.is_object() && root.contains("images")))
    throw BadInput(
        "{}: expected a list of images with detections, or boxes of COCO, labelme or Label Studio; "
        "from other tools export COCO",
        path);
  return ReadCoco(root, path);
}

DetectionFile ReadAny(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return ReadDetectionFolder(path);
  if (LowerExtension(path) == ".csv") return ReadDetectionCsv(path);
  if (LowerExtension(path) == ".xml")
    throw BadInput(
        "{}: XML, as of CVAT or Pascal VOC, is not read: export COCO (in CVAT: COCO 1.0)", path);
  return ReadJson(ParseDetections(path), path);
}

// Of a score, or of a pixel.
double FourPlaces(double x) { return std::round(x * 1e4) / 1e4; }
double TwoPlaces(double px) { return std::round(px * 100) / 100; }

nlohmann::ordered_json JsonOf(const Detection& d) {
  Box b = d.box;
  // A box that rounding would make empty is written as it is.
  if (const Box rounded{TwoPlaces(b.x1), TwoPlaces(b.y1), TwoPlaces(b.x2), TwoPlaces(b.y2)};
      rounded.Width() > 0 && rounded.Height() > 0)
    b = rounded;
  nlohmann::ordered_json json{{"category_id", d.category_id},
                              {"detection_score", FourPlaces(d.score)},
                              {"bbox", {b.x1, b.y1, b.x2, b.y2}}};
  // A score that is rounded to 0 cannot be shared.
  if (!d.other_labels.empty() && d.score >= 0.5e-4) {
    json["labels"].push_back({d.category_id, FourPlaces(d.score)});
    for (const Label& label : d.other_labels)
      json["labels"].push_back({label.category_id, FourPlaces(label.score)});
  }
  if (d.ellipse) {
    const auto& e = *d.ellipse;
    constexpr double kLeast = 0.01;  // pixels: an axis is above 0
    json["ellipse"] = {TwoPlaces(e[0]), TwoPlaces(e[1]), std::max(TwoPlaces(e[2]), kLeast),
                       std::max(TwoPlaces(e[3]), kLeast), std::round(e[4] * 1e6) / 1e6};
  }
  return json;
}

}  // namespace

struct OASLAM_LOCAL DetectionTable::Content {
  using Index = std::unordered_map<std::string, std::vector<size_t>>;

  explicit Content(std::vector<ImageDetections> all) : images(std::move(all)) {
    for (size_t i = 0; i < images.size(); ++i) {
      const std::string name = BaseName(images[i].file_name);
      by_name[name].push_back(i);
      by_stem[WithoutExtension(name)].push_back(i);
    }
  }

  // Of several images with this base name, the one in the folder of `image_name`.
  const ImageDetections* Find(const Index& index, const std::string& base,
                              const std::string& image_name) const {
    const auto same = index.find(base);
    if (same == index.end()) return nullptr;
    if (same->second.size() == 1) return &images[same->second.front()];
    for (const size_t i : same->second)
      if (AreInSameFolder(images[i].file_name, image_name)) return &images[i];
    return nullptr;
  }

  std::vector<ImageDetections> images;
  Index by_name, by_stem;
};

DetectionTable::DetectionTable(std::vector<ImageDetections> images)
    : content_(std::make_shared<const Content>(std::move(images))) {}
DetectionTable::DetectionTable() : DetectionTable(std::vector<ImageDetections>()) {}

const std::vector<ImageDetections>& DetectionTable::images() const { return content_->images; }

const std::vector<Detection>& DetectionTable::Find(const std::string& image_name) const {
  static const std::vector<Detection> none;
  const std::string name = BaseName(image_name);
  const ImageDetections* found = content_->Find(content_->by_name, name, image_name);
  if (found == nullptr)
    found = content_->Find(content_->by_stem, WithoutExtension(name), image_name);
  return found != nullptr ? found->detections : none;
}

DetectionFile ReadDetectionFile(const std::string& path) {
  DetectionFile file = ReadAny(path);
  std::set<std::string> seen;
  for (const ImageDetections& image : file.images)
    if (!seen.insert(image.file_name).second)
      throw BadInput("{}: {}: there are two entries with this name", path, image.file_name);
  return file;
}

void ConvertShares(int width, int height, DetectionFile& file) {
  if (!std::exchange(file.in_shares, false)) return;
  for (ImageDetections& image : file.images)
    for (Detection& detection : image.detections) {
      Box& box = detection.box;
      box = {box.x1 * width, box.y1 * height, box.x2 * width, box.y2 * height};
    }
}

void CheckNames(const DetectionFile& file, const std::string& path) {
  if (file.in_shares)
    throw BadInput(
        "{}: its boxes are shares of the image's width and height (YOLO): they need the images, or "
        "convert them to COCO",
        path);
  if (file.has_numbers_for_names)
    throw BadInput(
        "{}: names images by number; put their list {{\"images\": [{{\"id\", "
        "\"file_name\"}}]}} beside it as {}.images.json",
        path, std::filesystem::path(path).stem().string());
}

DetectionTable LoadDetections(const std::string& path) {
  DetectionFile file = ReadDetectionFile(path);
  CheckNames(file, path);
  return DetectionTable(std::move(file.images));
}

void SaveDetections(const std::string& path, const std::vector<ImageDetections>& images) {
  std::string text = "[";  // a line for each image
  for (const ImageDetections& image : images) {
    nlohmann::ordered_json line{{"file_name", image.file_name},
                                {"detections", nlohmann::ordered_json::array()}};
    for (const Detection& d : image.detections) {
      if (!std::isfinite(d.score + d.box.x1 + d.box.y1 + d.box.x2 + d.box.y2))
        throw BadInput("{}: {}: detection {} has a number that is not finite", path,
                       image.file_name, &d - image.detections.data());
      line["detections"].push_back(JsonOf(d));
    }
    text += (&image == &images.front() ? "\n" : ",\n") + JsonText(line);
  }
  WriteTextFile(path, text + "\n]\n");
}

}  // namespace oaslam
