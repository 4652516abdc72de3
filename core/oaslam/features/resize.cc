#include "oaslam/features/resize.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "oaslam/features/resize_kernels.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// Where a pixel of a resized row or column lies in the image.
struct Place {
  int first = 0;       // the pixel before it
  int16_t weight = 0;  // of the pixel behind it, in 1/2048
};

std::vector<Place> PlacesOf(int resized_size, int size) {
  const double scale = static_cast<double>(size) / resized_size;
  std::vector<Place> places(resized_size);
  for (int i = 0; i < resized_size; ++i) {
    // Rounded as OpenCV rounds it. Beyond the outermost pixels the image goes on as they are.
    const float position =
        std::clamp(static_cast<float>((i + 0.5) * scale - 0.5), 0.F, static_cast<float>(size - 1));
    const int first = std::min(static_cast<int>(position), size - 2);
    places[i] = {first,
                 static_cast<int16_t>(std::lrint((position - static_cast<float>(first)) * 2048))};
  }
  return places;
}

std::vector<ResizeWindow> WindowsOf(const std::vector<Place>& places, int width) {
  const int count = static_cast<int>(places.size());
  std::vector<ResizeWindow> windows;
  for (int x = 0; x < count;) {
    ResizeWindow& w = windows.emplace_back();
    w.first = std::min(places[x].first, width - ResizeWindow::kPixels);
    w.result = x;
    for (int i = 0; i < ResizeWindow::kResults && x < count; ++i, ++x) {
      const int left = places[x].first - w.first;
      if (left + 1 >= ResizeWindow::kPixels) break;
      w.pairs[2 * i] = static_cast<uint8_t>(left);
      w.pairs[2 * i + 1] = static_cast<uint8_t>(left + 1);
    }
  }
  return windows;
}

// The pixels of a row or column of which one of the resized image is the weighted mean.
struct Taps {
  int first = 0;
  std::vector<float> weights;  // of `first` and of those behind it; their sum is 1
};

std::vector<Taps> AreaTaps(int resized_size, int size) {
  std::vector<Taps> taps(resized_size);
  for (int i = 0; i < resized_size; ++i) {
    // In this unit a pixel of the image has the length `resized_size`, a resized one that of
    // `size`.
    const int64_t begin = int64_t{i} * size, end = begin + size, first = begin / resized_size;
    taps[i].first = static_cast<int>(first);
    for (int64_t edge = first * resized_size; edge < end; edge += resized_size) {
      const int64_t covered = std::min(edge + resized_size, end) - std::max(edge, begin);
      taps[i].weights.push_back(static_cast<float>(covered) / static_cast<float>(size));
    }
  }
  return taps;
}

// Those of cubic convolution (Keys 1981), with the slope of OpenCV's INTER_CUBIC.
std::vector<Taps> CubicTaps(int resized_size, int size) {
  constexpr float kSlope = -0.75F;
  std::vector<Taps> taps;
  for (const Place& place : PlacesOf(resized_size, size)) {
    const float t = static_cast<float>(place.weight) / 2048, rest = 1 - t;
    const float before = kSlope * t * rest * rest, behind = kSlope * rest * t * t;
    const float left = ((kSlope + 2) * t - (kSlope + 3)) * t * t + 1;
    const float weights[] = {before, left, 1 - before - left - behind, behind};
    Taps& tap = taps.emplace_back();
    tap.first = std::clamp(place.first - 1, 0, size - 4);
    tap.weights.resize(4);
    // Beyond the edge the image goes on as its outermost pixel.
    for (int k = 0; k < 4; ++k)
      tap.weights[std::clamp(place.first - 1 + k, 0, size - 1) - tap.first] += weights[k];
  }
  return taps;
}

void ResizeByTaps(const GreyImage& image, const std::vector<Taps>& columns,
                  const std::vector<Taps>& rows, GreyBuffer& resized) {
  std::vector<float> means(image.width);  // of the columns of the image
  for (int y = 0; y < resized.height(); ++y) {
    std::ranges::fill(means, 0);
    const uint8_t* row = image.Row(rows[y].first);
    for (const float weight : rows[y].weights) {
      for (int x = 0; x < image.width; ++x) means[x] += weight * row[x];
      row += image.step;
    }
    uint8_t* grey = resized.Row(y);
    for (int x = 0; x < resized.width(); ++x) {
      float mean = 0.5F;
      const float* value = means.data() + columns[x].first;
      for (const float weight : columns[x].weights) mean += weight * *value++;
      grey[x] = static_cast<uint8_t>(std::clamp(mean, 0.F, 255.F));
    }
  }
}

}  // namespace

void ResizeLinear(const GreyImage& image, GreyBuffer& resized) {
  OASLAM_CHECK(std::min({image.width, image.height, resized.width(), resized.height()}) >=
               kMinInterpolatedWidth);
  const std::vector<Place> columns = PlacesOf(resized.width(), image.width),
                           rows = PlacesOf(resized.height(), image.height);
  const std::vector<ResizeWindow> windows = WindowsOf(columns, image.width);
  const size_t length = columns.size() + ResizeWindow::kResults;
  std::vector<int16_t> weights(length);
  for (size_t x = 0; x < columns.size(); ++x) weights[x] = columns[x].weight;
  // The two rows that were interpolated last: one of an even and one of an odd number.
  struct Row {
    int y = -1;
    std::vector<int16_t> values;
  };
  std::array<Row, 2> last;
  for (Row& row : last) row.values.resize(length);
  const auto row_at = [&](int y) {
    Row& row = last[y % 2];
    if (row.y != y) InterpolateInRow(image.Row(y), windows, weights.data(), row.values.data());
    row.y = y;
    return row.values.data();
  };
  for (int y = 0; y < resized.height(); ++y)
    InterpolateBetweenRows(row_at(rows[y].first), row_at(rows[y].first + 1), rows[y].weight,
                           resized.width(), resized.Row(y));
}

void ResizeByArea(const GreyImage& image, GreyBuffer& resized) {
  OASLAM_CHECK(resized.width() <= image.width && resized.height() <= image.height);
  ResizeByTaps(image, AreaTaps(resized.width(), image.width),
               AreaTaps(resized.height(), image.height), resized);
}

void ResizeCubic(const GreyImage& image, GreyBuffer& resized) {
  OASLAM_CHECK(std::min(image.width, image.height) >= 4);
  ResizeByTaps(image, CubicTaps(resized.width(), image.width),
               CubicTaps(resized.height(), image.height), resized);
}

}  // namespace oaslam
