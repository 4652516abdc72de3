#include "oaslam/formats/camera_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/lens_models.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// "ID MODEL WIDTH HEIGHT PARAMS..."
Camera ReadColmapLine(const std::vector<std::string_view>& fields, const std::string& place) {
  const auto model = std::ranges::find(kColmapModels, fields[1], &ColmapModel::name);
  if (model == std::end(kColmapModels))
    throw BadInput(
        "{}: camera model \"{}\" is not known here; let COLMAP undistort the images "
        "(image_undistorter), or convert the model",
        place, fields[1]);
  std::vector<double> values;
  for (size_t i = 2; i < fields.size(); ++i) {
    const auto value = ParseNumber(fields[i]);
    if (!value) throw BadInput("{}: \"{}\", expected a number", place, fields[i]);
    values.push_back(*value);
  }
  const size_t expected = 2 + model->Parameters();
  if (values.size() != expected)
    throw BadInput("{}: {} numbers after {}, expected {}", place, values.size(), model->name,
                   expected);
  const auto [width, height] = std::pair{values[0], values[1]};
  if (!(width >= 1 && width <= kMaxSide && height >= 1 && height <= kMaxSide))
    throw BadInput("{}: image size {} x {}, allowed: 1 to {}", place, width, height, kMaxSide);
  Camera camera{
      .model = model->model, .width = static_cast<int>(width), .height = static_cast<int>(height)};
  const double* p = values.data() + 2;
  camera.fx = p[0];
  camera.fy = p[model->focal_lengths - 1];
  // COLMAP's pixel centres are at half integers, ours at integers.
  camera.cx = p[model->focal_lengths] - 0.5;
  camera.cy = p[model->focal_lengths + 1] - 0.5;
  std::vector<double> k(values.end() - static_cast<std::ptrdiff_t>(model->coefficients),
                        values.end());
  const LensPlace lens{place, "distortion"};
  const std::string_view name = model->name;
  if (name == "FOV") {
    SetLens(camera, FieldOfViewLens(k[0]), model->name, lens);
  } else if (name == "THIN_PRISM_FISHEYE") {
    SetLens(camera, ThinPrismFisheyeLens(k), model->name, lens);
  } else {
    if (k.size() < 4) k.resize(4, 0.0);
    SetDistortion(camera, k, lens);
  }
  return camera;
}

Camera ReadColmapKind(const std::string& text, const std::string& path,
                      const cv::Size& image_size) {
  std::vector<Camera> cameras;
  int line_number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++line_number;
    const auto fields = SplitFields(line);
    if (fields.empty() || fields[0][0] == '#') continue;
    const std::string place = fmt::format("{}:{}", path, line_number);
    if (fields.size() < 5) throw BadInput("{}: expected ID MODEL WIDTH HEIGHT PARAMS", place);
    cameras.push_back(ReadColmapLine(fields, place));
  }
  if (cameras.size() == 1) return cameras[0];
  const auto fits = [&](const Camera& c) {
    return c.width == image_size.width && c.height == image_size.height;
  };
  if (std::ranges::count_if(cameras, fits) != 1)
    throw BadInput(
        "{}: holds {} cameras, expected exactly one for images of {} x {}; "
        "--camera auto estimates one",
        path, cameras.size(), image_size.width, image_size.height);
  return *std::ranges::find_if(cameras, fits);
}

// Whether the first line that is no comment starts with a number and a word in capitals.
bool IsColmap(const std::string& text) {
  for (const std::string_view line : SplitLines(text)) {
    const auto fields = SplitFields(line);
    if (fields.empty() || fields[0][0] == '#') continue;
    return fields.size() >= 2 && ParseNumber(fields[0]) &&
           std::ranges::all_of(fields[1],
                               [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
  }
  return false;
}

// The numbers of each line; nothing where a line has anything else. Commas separate as blanks do.
std::optional<std::vector<std::vector<double>>> ReadNumbers(std::string text) {
  std::ranges::replace(text, ',', ' ');
  std::vector<std::vector<double>> rows;
  for (const std::string_view line : SplitLines(text)) {
    const auto fields = SplitFields(line);
    if (fields.empty() || fields[0][0] == '#') continue;
    std::vector<double>& row = rows.emplace_back();
    for (const std::string_view field : fields) {
      const auto value = ParseNumber(field);
      if (!value) return std::nullopt;
      row.push_back(*value);
    }
  }
  return rows;
}

Camera ReadNumberRows(const std::vector<std::vector<double>>& rows, const std::string& path,
                      const cv::Size& image_size) {
  Camera camera;
  if (rows.size() == 1 && rows[0].size() >= 4) {
    const std::vector<double>& row = rows[0];
    camera.fx = row[0], camera.fy = row[1], camera.cx = row[2], camera.cy = row[3];
    SetDistortion(camera, std::span(row).subspan(4),
                  {path, "numbers after fx fy cx cy", image_size});
    return camera;
  }
  const auto is_row = [](const std::vector<double>& row) {
    return row.size() == 3 || row.size() == 4;
  };
  if (rows.size() < 3 || rows.size() > 4 || !std::ranges::all_of(rows, is_row))
    throw BadInput(
        "{}: numbers alone, expected one line \"fx fy cx cy [k1 k2 p1 p2 [k3 ...]]\", or "
        "a matrix of three or four rows",
        path);
  if (rows[0][1] != 0 || rows[1][0] != 0 || rows[2][0] != 0 || rows[2][1] != 0 || rows[2][2] != 1)
    throw BadInput("{}: a matrix, expected the rows fx 0 cx, 0 fy cy, 0 0 1", path);
  camera.fx = rows[0][0], camera.cx = rows[0][2], camera.fy = rows[1][1], camera.cy = rows[1][2];
  return camera;
}

}  // namespace

std::optional<Camera> ReadCameraLines(const std::string& text, const std::string& path,
                                      const cv::Size& image_size) {
  if (IsColmap(text)) return ReadColmapKind(text, path, image_size);
  const auto rows = ReadNumbers(text);
  return rows && !rows->empty() ? std::optional(ReadNumberRows(*rows, path, image_size))
                                : std::nullopt;
}

}  // namespace oaslam
