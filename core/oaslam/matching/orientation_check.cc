#include "oaslam/matching/orientation_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace oaslam {

std::vector<char> ConsistentOrientations(const std::vector<float>& angle_differences_rad) {
  // Of 12 degrees, the steps of orientation of ORB's descriptor (Rublee et al. 2011).
  constexpr int kBins = 30;
  std::array<int, kBins> histogram{};
  std::vector<int> bin_of(angle_differences_rad.size());
  for (size_t i = 0; i < bin_of.size(); ++i) {
    const double turns = angle_differences_rad[i] / (2 * std::numbers::pi);
    bin_of[i] = static_cast<int>(std::lround((turns - std::floor(turns)) * kBins)) % kBins;
    ++histogram[bin_of[i]];
  }
  std::array<int, kBins> order{};
  for (int b = 0; b < kBins; ++b) order[b] = b;
  std::ranges::stable_sort(order, [&](int a, int b) { return histogram[a] > histogram[b]; });
  std::array<char, kBins> keep{};
  for (int rank = 0; rank < 3; ++rank)
    keep[order[rank]] = histogram[order[rank]] * 10 >= histogram[order[0]];
  std::vector<char> consistent(bin_of.size());
  std::ranges::transform(bin_of, consistent.begin(), [&](int b) { return keep[b]; });
  return consistent;
}

}  // namespace oaslam
