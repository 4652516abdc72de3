#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "oaslam/types.h"

namespace oaslam {

constexpr int kMaxCategory = 1'000'000;

// The checks for whoever takes detections in, be it from a file or from an application. Each says
// what is wrong with one part of a detection, with its value and its bound; empty where nothing is.
std::string ProblemOfCategory(int64_t category_id);
std::string ProblemOfScore(double score);
std::string ProblemOfBox(const Box& box);
std::string ProblemOfEllipse(const std::array<double, 5>& ellipse);

// The first problem of all parts, with the name of the part: "box: [5, 0, 1, 9], expected ...".
std::string ProblemOf(const Detection& detection);

}  // namespace oaslam
