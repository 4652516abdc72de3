#pragma once

#include <cstdint>
#include <span>

namespace oaslam {

// The two halves of ResizeLinear, in the widest vectors of the processor (Highway, chosen at run
// time), on integers, so that every processor gives the same bits.

constexpr int kMinInterpolatedWidth = 16;  // least width of a row, before and after

// Sixteen pixels of a row, from which up to eight pixels of a resized row are interpolated.
struct ResizeWindow {
  static constexpr int kPixels = 16, kResults = 8;
  int first = 0;                         // of the pixels
  int result = 0;                        // first of the results
  alignas(16) uint8_t pairs[kPixels]{};  // of each result its left and its right pixel
};

// Interpolates a row, to 1/128 grey levels. `weights` are those of the right pixels, in 1/2048.
// Each window writes kResults values, some of which the next window may overwrite; `weights` and
// `results` therefore need kResults elements more than the row has.
void InterpolateInRow(const uint8_t* row, std::span<const ResizeWindow> windows,
                      const int16_t* weights, int16_t* results);

// Interpolates between two such rows, to grey levels. `weight` is that of the second, in 1/2048.
void InterpolateBetweenRows(const int16_t* first, const int16_t* second, int16_t weight, int width,
                            uint8_t* grey);

}  // namespace oaslam
