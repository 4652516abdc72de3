#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "oaslam/types.h"

namespace oaslam {

// More than any data set has classes; a larger number is a mistake, such as an id of an image.
constexpr int kMaxCategory = 1'000'000;

// Checks of detections, from files and from applications. Each describes the problem of one part of
// a detection, with its value and bound; empty if there is none.
std::string ProblemOfCategory(int64_t category_id);
std::string ProblemOfScore(double score);
// Classes and scores, and that no class is listed twice.
std::string ProblemOfLabels(std::span<const Label> labels);
std::string ProblemOfBox(const Box& box);
std::string ProblemOfEllipse(const std::array<double, 5>& ellipse);

// The first problem of all parts, with the name of the part: "box: [5, 0, 1, 9], expected ...".
std::string ProblemOf(const Detection& detection);

}  // namespace oaslam
