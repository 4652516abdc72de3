#include "oaslam/description/corner_describer.h"

#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>

#include "expect_input_error.h"
#include "grey_scene.h"

namespace oaslam {
namespace {

// What `train/export.py --reference data/descriptor/v1.bin` wrote: PyTorch's descriptors of corners
// of a picture made by a formula.
struct Reference {
  int width = 0, height = 0;
  int64_t sum = 0;  // of the picture's pixels
  std::vector<ScaledCorner> corners;
  std::vector<Descriptor> descriptors;
};

Reference ReadReference() {
  Reference reference;
  std::ifstream file(OASLAM_SOURCE_DIR "/tests/data/descriptor_reference.txt");
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind, skipped;
    words >> kind;
    if (kind == "picture")
      words >> reference.width >> reference.height >> skipped >> skipped >> skipped >> skipped >>
          reference.sum;
    if (kind != "bits") continue;
    ScaledCorner& corner = reference.corners.emplace_back();
    words >> corner.px.x() >> corner.px.y() >> corner.scale;
    for (uint64_t& word : reference.descriptors.emplace_back()) words >> std::hex >> word;
    EXPECT_TRUE(words) << line;
  }
  return reference;
}

GreyBuffer PictureOfReference(int width, int height) {
  return synthetic::Drawn(width, height, [](int x, int y) {
    return (x * x + 3 * y * y + 5 * x * y) / 32 + 40 * ((x / 9 + y / 7) % 3);
  });
}

int64_t Sum(const GreyBuffer& image) {
  int64_t sum = 0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) sum += image.Row(y)[x];
  return sum;
}

// Of a real descriptor some 128 of the 256 bits are set.
void ExpectDescriptions(const std::vector<Descriptor>& descriptors) {
  for (const Descriptor& descriptor : descriptors)
    EXPECT_NEAR(HammingDistance(descriptor, Descriptor{}), 128, 64);
}

// The sign of a value near 0 may differ.
constexpr int kRounding = 2;

TEST(CornerDescriber, GivesTheDescriptorsOfTraining) {
  const Reference reference = ReadReference();
  ASSERT_EQ(reference.corners.size(), 6U);
  const GreyBuffer picture = PictureOfReference(reference.width, reference.height);
  ASSERT_EQ(Sum(picture), reference.sum);
  const auto descriptors = CornerDescriber().Describe(picture.view(), reference.corners);
  ASSERT_EQ(descriptors.size(), reference.descriptors.size());
  for (size_t i = 0; i < descriptors.size(); ++i)
    EXPECT_LE(HammingDistance(descriptors[i], reference.descriptors[i]), kRounding)
        << "corner " << i;
}

// Each octave has buffers and a network of its own, which fit the image before.
TEST(CornerDescriber, WhatWasDescribedBeforeDoesNotMatter) {
  const GreyBuffer large = synthetic::RandomScene(320, 240, 1);
  const GreyBuffer odd = synthetic::RandomScene(111, 77, 2);
  const std::vector<ScaledCorner> corners{{{50, 40}, 1}, {{20.5F, 60}, 2}, {{90, 10}, 3.6F}};
  CornerDescriber describer;
  const auto first = describer.Describe(odd.view(), corners);
  ExpectDescriptions(first);
  EXPECT_EQ(describer.Describe(odd.view(), corners), first);
  const auto other = describer.Describe(large.view(), corners);
  EXPECT_NE(other, first);
  EXPECT_EQ(describer.Describe(odd.view(), corners), first);
  EXPECT_EQ(CornerDescriber().Describe(large.view(), corners), other);
}

TEST(CornerDescriber, ACornerDoesNotDependOnTheOthers) {
  const GreyBuffer image = synthetic::RandomScene(160, 120, 3);
  const std::vector<ScaledCorner> corners{{{50, 40}, 3.6F}, {{20, 60}, 1}, {{90, 10}, 2}};
  CornerDescriber describer;
  const auto together = describer.Describe(image.view(), corners);
  for (size_t i = 0; i < corners.size(); ++i)
    EXPECT_LE(HammingDistance(describer.Describe(image.view(), std::span(corners).subspan(i, 1))[0],
                              together[i]),
              kRounding);
  EXPECT_TRUE(describer.Describe(image.view(), {}).empty());
}

TEST(CornerDescriber, ThreadsDoNotMatter) {
  const GreyBuffer image = synthetic::RandomScene(320, 240, 4);
  const std::vector<ScaledCorner> corners{{{50, 40}, 1}, {{200, 160}, 2}};
  const auto by_all = CornerDescriber().Describe(image.view(), corners);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  EXPECT_EQ(CornerDescriber().Describe(image.view(), corners), by_all);
  cv::setNumThreads(threads);
}

TEST(CornerDescriber, TakesSmallImages) {
  const std::vector<ScaledCorner> corners{{{0, 0}, 1}, {{0, 0}, 2}, {{0, 0}, 4}};
  CornerDescriber describer;
  for (const auto& [width, height] : {std::pair{63, 33}, {40, 7}, {3, 3}, {1, 20}, {1, 1}}) {
    const GreyBuffer image = PictureOfReference(width, height);
    ExpectDescriptions(describer.Describe(image.view(), corners));
  }
}

TEST(CornerDescriber, PixelsBetweenRowsDoNotMatter) {
  GreyBuffer whole = synthetic::RandomScene(140, 120, 5);
  const GreyImage part = whole.view().Inside(20);
  GreyBuffer copy =
      synthetic::Drawn(part.width, part.height, [&](int x, int y) { return int{part.Row(y)[x]}; });
  const std::vector<ScaledCorner> corners{{{0, 0}, 1}, {{99, 79}, 1}, {{50, 40}, 2}};
  EXPECT_EQ(CornerDescriber().Describe(part, corners),
            CornerDescriber().Describe(copy.view(), corners));
}

// The last cells of an image of 128 x 96 begin at row 92 and 88.
TEST(CornerDescriber, BeyondTheBorderIsAtTheBorder) {
  const GreyBuffer image = synthetic::RandomScene(128, 96, 6);
  const std::vector<ScaledCorner> outside{{{-40, 1e9F}, 1}, {{NAN, -1}, 1}};
  const std::vector<ScaledCorner> border{{{0, 92}, 1}, {{0, 0}, 1}};
  const auto described = CornerDescriber().Describe(image.view(), outside);
  ExpectDescriptions(described);
  EXPECT_NE(described[0], described[1]);
  EXPECT_EQ(described, CornerDescriber().Describe(image.view(), border));
}

// A corner looks the same in an image as large again, at twice its scale.
TEST(CornerDescriber, LargerScalesAreDescribedInSmallerImages) {
  const GreyBuffer small = synthetic::RandomScene(160, 120, 7);
  const GreyBuffer large =
      synthetic::Drawn(320, 240, [&](int x, int y) { return int{small.Row(y / 2)[x / 2]}; });
  const std::vector<ScaledCorner> corners{{{50, 40}, 1}, {{120, 90}, 1.2F}};
  std::vector<ScaledCorner> twice;
  for (const auto& [px, scale] : corners)
    twice.push_back({px * 2 + Eigen::Vector2f(.5F, .5F), scale * 2});
  EXPECT_EQ(CornerDescriber().Describe(large.view(), twice),
            CornerDescriber().Describe(small.view(), corners));
}

std::string ErrorOf(const std::string& weights) {
  return InputErrorOf([&] { CornerDescriber{weights}; });
}

std::string WithByte(size_t at, char byte) {
  std::string weights(DescriptorWeights());
  EXPECT_NE(weights.at(at), byte);
  weights[at] = byte;
  return weights;
}

TEST(CornerDescriber, RefusesOtherFiles) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("not a file of weights, which begins with OASLDESC"));
  EXPECT_THAT(ErrorOf(WithByte(0, 'X')), HasSubstr("begins with OASLDESC"));
  EXPECT_THAT(ErrorOf(WithByte(8, 2)), HasSubstr("of version 2; this program reads version 1"));
  EXPECT_THAT(ErrorOf(WithByte(12, 15)), HasSubstr("has 15 layers, not 14"));
}

TEST(CornerDescriber, RefusesFilesOfAnotherSize) {
  const std::string whole(DescriptorWeights());
  EXPECT_THAT(ErrorOf(whole.substr(0, 15)), HasSubstr("ends in its header"));
  EXPECT_THAT(ErrorOf(whole.substr(0, 1000)), HasSubstr("has 1000 bytes, not 352520"));
  EXPECT_THAT(ErrorOf(whole + "x"), HasSubstr("has 352521 bytes, not 352520"));
}

TEST(CornerDescriber, RefusesAnotherNetwork) {
  EXPECT_THAT(ErrorOf(WithByte(20, 'F')),
              HasSubstr("a layer First (8, 1, 3, 2) where first (8, 1, 3, 2)"));
}

}  // namespace
}  // namespace oaslam
