#pragma once

#include <cstdint>

namespace oaslam {

// Seeded random numbers, the same on every platform (SplitMix64, Steele et al. 2014). Passed as an
// argument, never global.
class Rng {
 public:
  explicit Rng(uint64_t seed) : state_(seed) {}

  uint64_t Next() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

  // Uniform in [0, n), n > 0.
  int Index(int n) { return static_cast<int>(Next() % static_cast<uint64_t>(n)); }

  // Uniform in [low, high).
  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(Next() >> 11) * 0x1.0p-53);
  }

  double Gaussian(double sigma);

 private:
  uint64_t state_;
};

}  // namespace oaslam
