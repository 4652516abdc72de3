#include "oaslam/formats/detection_input.h"

#include <fmt/format.h>

#include "expect_input_error.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

// An image of each name, of which the i-th has a box of category i.
std::vector<ImageDetections> Boxes(const std::vector<std::string>& names) {
  std::vector<ImageDetections> images;
  for (size_t i = 0; i < names.size(); ++i)
    images.push_back({names[i], {{static_cast<int>(i), 0.5, {1, 2, 3, 4}, {}, {}}}});
  return images;
}

// The category of the box of an image, -1 where it has none.
int CategoryAt(const DetectionTable& table, const std::string& image) {
  const auto& found = table.Find(image);
  return found.empty() ? -1 : found[0].category_id;
}

std::vector<std::string> Video(int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(fmt::format("{:06}", i));
  return names;
}

DetectionTable Match(const std::vector<std::string>& names,
                     const std::vector<std::string>& images) {
  return MatchedToImages(DetectionTable(Boxes(names)), images, "d.json");
}

TEST(MatchedToImages, NamesThatFitStay) {
  const DetectionTable table = Match({"000000.jpg", "000002.jpg", "000900.jpg"}, Video(5));
  EXPECT_EQ(CategoryAt(table, "000002"), 1);
  EXPECT_EQ(CategoryAt(table, "000001"), -1);
  EXPECT_THAT(Match({}, Video(5)).images(), IsEmpty());
  EXPECT_THAT(Match({"a.jpg"}, {}).images(), SizeIs(1));  // a camera: names are not known before
}

TEST(MatchedToImages, InEitherNormalForm) {
  const std::string composed = "Küche", decomposed =
                                            "Ku\xCC\x88"
                                            "che";
  for (const auto& [name, image] :
       {std::pair(composed, decomposed), std::pair(decomposed, composed)})
    EXPECT_EQ(
        CategoryAt(Match({"a.jpg", name + ".jpg"}, {"a.png", image + ".png"}), image + ".png"), 1);
  // Two images whose names are one name: neither is taken for the other.
  const DetectionTable both =
      Match({composed + ".png", decomposed + ".png"}, {composed, decomposed});
  EXPECT_EQ(CategoryAt(both, composed), 0);
  EXPECT_EQ(CategoryAt(both, decomposed), 1);
}

TEST(MatchedToImages, WithBytesThatAreNotUtf8) {
  EXPECT_EQ(CategoryAt(Match({"a.jpg", "caf\uFFFD.jpg"}, {"a.jpg", "caf\xE9.jpg"}), "caf\xE9.jpg"),
            1);
}

TEST(MatchedToImages, ByFolderWhereImagesHaveOneName) {
  const std::vector<std::string> images{"/d/left/1.png", "/d/right/1.png", "/d/right/2.png"};
  const DetectionTable both = Match({"left/1.png", "right/1.png"}, images);
  EXPECT_EQ(CategoryAt(both, images[0]), 0);
  EXPECT_EQ(CategoryAt(both, images[1]), 1);
  const DetectionTable one = Match({"right/2.png", "left/1.png"}, images);
  EXPECT_EQ(CategoryAt(one, images[0]), 1);
  EXPECT_EQ(CategoryAt(one, images[1]), -1);
  EXPECT_EQ(CategoryAt(one, images[2]), 0);
  EXPECT_INPUT_ERROR(Match({"1.png"}, images), HasSubstrs("d.json", "\"1.png\" of 2 images",
                                                          "/d/left/1.png", "need the folder"));
  EXPECT_INPUT_ERROR(Match({"a/2.png", "b/2.png"}, images),
                     HasSubstrs("/d/right/2.png", "\"a/2.png\" of 1 images"));
}

TEST(MatchedToImages, ByNumber) {
  EXPECT_EQ(CategoryAt(Match({"clip_0.jpg", "clip_3.jpg"}, Video(5)), "000003"), 1);
  EXPECT_EQ(CategoryAt(Match({"0000.jpg", "0003.jpg"}, Video(5)), "000003"), 1);
  EXPECT_EQ(CategoryAt(Match({"f1_left.jpg", "f2_left.jpg"}, {"cam0_00002.png"}), "cam0_00002.png"),
            1);
  EXPECT_EQ(CategoryAt(Match({"1.5.jpg", "10.0.jpg"}, {"1.500000.png", "10.png"}), "10.png"), 1);
  // The first number, where the last is that of the camera.
  EXPECT_EQ(CategoryAt(Match({"7_cam2.jpg", "8_cam2.jpg"}, Video(9)), "000008"), 1);
}

TEST(MatchedToImages, CountedFromOne) {
  std::vector<std::string> prefixed, plain;
  for (int i = 1; i <= 5; ++i) {
    prefixed.push_back(fmt::format("clip_{}.jpg", i));
    plain.push_back(fmt::format("{:06}.jpg", i));  // as ffmpeg extracts images
  }
  for (const auto& names : {prefixed, plain}) {
    const DetectionTable table = Match(names, Video(5));
    for (int i = 0; i < 5; ++i) EXPECT_EQ(CategoryAt(table, fmt::format("{:06}", i)), i);
  }
  // A video that has further images.
  EXPECT_EQ(CategoryAt(Match(plain, Video(20)), "000001"), 0);
}

// As detectors write them that know images by their index.
TEST(MatchedToImages, NumbersOfCocoResultsWithoutAList) {
  const TempFolder folder;
  const std::string path = folder.Write(
      "r.json", R"([{"image_id": 3, "category_id": 7, "bbox": [1, 2, 5, 6], "score": 0.5}])");
  const DetectionFile file = ReadDetectionFile(path);
  EXPECT_TRUE(file.has_numbers_for_names);
  EXPECT_EQ(CategoryAt(MatchedToImages(DetectionTable(file.images), Video(5), path), "000003"), 7);
  EXPECT_INPUT_ERROR(CheckNames(file, path), HasSubstr("r.images.json"));
}

TEST(MatchedToImages, WhatDoesNotFitIsRefusedWithTwoExamples) {
  const auto error = [](const std::vector<std::string>& names,
                        const std::vector<std::string>& images) {
    return InputErrorOf([&] { Match(names, images); });
  };
  EXPECT_THAT(error({"kitchen.jpg", "hall.jpg"}, Video(5)),
              HasSubstrs("d.json: none of its 2 names", "\"kitchen.jpg\"", "\"000000\""));
  EXPECT_THAT(error({"a_1.jpg", "b_1.jpg"}, Video(5)), HasSubstr("\"a_1.jpg\""));
  EXPECT_THAT(error({"clip_100.jpg"}, Video(5)), HasSubstr("\"clip_100.jpg\""));
  EXPECT_THAT(error({"000001.jpg", "000001.png"}, Video(5)),
              HasSubstr("2 names are \"000001\" without their extension"));
}

TEST(CocoNumbers, AreRecognised) {
  std::vector<ImageDetections> images = Boxes({"a"});
  const auto numbers = [&](int category) {
    images[0].detections[0].category_id = category;
    return NumbersOf(images);
  };
  EXPECT_EQ(numbers(0), CocoNumbers::k80);    // there is no 0 among 91
  EXPECT_EQ(numbers(12), CocoNumbers::k80);   // nor 12
  EXPECT_EQ(numbers(200), CocoNumbers::k80);  // of classes of one's own
  EXPECT_EQ(numbers(84), CocoNumbers::k91);
  EXPECT_EQ(numbers(41), CocoNumbers::kUnclear);
  const auto renumbered = [&](int category) {
    images[0].detections[0].category_id = category;
    Renumber91To80(images);
    return CocoClassNames().at(images[0].detections[0].category_id);
  };
  EXPECT_EQ(renumbered(1), "person");
  EXPECT_EQ(renumbered(13), "stop sign");
  EXPECT_EQ(renumbered(47), "cup");
  EXPECT_EQ(renumbered(73), "laptop");
  EXPECT_EQ(renumbered(90), "toothbrush");
}

TEST(CocoNumbers, CategoriesGiveNames) {
  const TempFolder folder;
  DetectionFile file = ReadDetectionFile(folder.Write("coco.json", R"({
    "images": [{"id": 1, "file_name": "x.png"}],
    "categories": [{"id": 7, "name": "cup"}, {"id": 8, "name": "shelf"}],
    "annotations": [{"image_id": 1, "category_id": 7, "bbox": [1, 2, 5, 6]}]})"));
  EXPECT_EQ(file.categories, (ClassNames{{7, "cup"}, {8, "shelf"}}));
  EXPECT_TRUE(RenumberByName(file.categories, CocoClassNames(), file.images));
  EXPECT_EQ(file.images[0].detections[0].category_id, 41);
  file.images[0].detections[0].category_id = 8;
  EXPECT_FALSE(RenumberByName(file.categories, CocoClassNames(), file.images));
  EXPECT_EQ(file.images[0].detections[0].category_id, 8);
  EXPECT_INPUT_ERROR(
      ReadDetectionFile(folder.Write(
          "coco.json", R"({"images": [], "annotations": [], "categories": [{"id": 1}]})")),
      HasSubstr("categories[0]: key \"name\" is missing"));
}

}  // namespace
}  // namespace oaslam
