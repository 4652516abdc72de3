#include "oaslam/models/catalogue.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <map>

#include "expect_input_error.h"
#include "oaslam/crypto/sha256.h"
#include "oaslam/detection/model_folders.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

// A catalogue of one entry, with another value of one key.
std::string Entry(const std::string& key, const std::string& value) {
  std::map<std::string, std::string> entry{{"name", R"("a")"},
                                           {"finds", R"("cups")"},
                                           {"bytes", "3"},
                                           {"sha256", fmt::format(R"("{}")", std::string(64, '0'))},
                                           {"licence", R"("MIT")"},
                                           {"author", R"("b")"},
                                           {"url", R"("https://a.example/v1/a.onnx")"}};
  entry[key] = value;
  std::string text;
  for (const auto& [k, v] : entry)
    text += fmt::format("{}\"{}\": {}", text.empty() ? "" : ", ", k, v);
  return fmt::format("{{\"models\": [{{{}}}]}}", text);
}

TEST(Catalogue, ThatOfTheProgramIsComplete) {
  unsetenv("OASLAM_MODELS_CATALOGUE");
  unsetenv("OASLAM_MODELS_URL");
  const std::vector<PublishedModel> catalogue = ModelCatalogue();
  const PublishedModel* nano = FindPublished(catalogue, kDefaultModel);
  ASSERT_NE(nano, nullptr);
  EXPECT_EQ(nano->bytes, 3659407);
  EXPECT_EQ(nano->url,
            "https://github.com/Megvii-BaseDetection/YOLOX/releases/download/0.1.1rc0/"
            "yolox_nano.onnx");
  for (const PublishedModel& model : catalogue) EXPECT_EQ(model.licence, "Apache-2.0");
  EXPECT_EQ(FindPublished(catalogue, "yolo"), nullptr);
}

TEST(Catalogue, AMirrorReplacesTheFolders) {
  setenv("OASLAM_MODELS_URL", "http://10.0.0.1/models//", 1);
  EXPECT_EQ(ModelCatalogue().front().url, "http://10.0.0.1/models/yolox_nano.onnx");
  setenv("OASLAM_MODELS_URL", "file:///models", 1);
  EXPECT_INPUT_ERROR(ModelCatalogue(), HasSubstr("file:///models"));
  unsetenv("OASLAM_MODELS_URL");
}

TEST(Catalogue, MistakesAreNamed) {
  const auto error_of = [](const std::string& text) {
    return InputErrorOf([&] { ParseModelCatalogue(text, "c.json"); });
  };
  EXPECT_EQ(ParseModelCatalogue(Entry("finds", "\"cups\""), "c.json").front().finds, "cups");
  for (const auto& [key, value] : std::map<std::string, std::string>{{"name", "\"../a\""},
                                                                     {"finds", "\"\""},
                                                                     {"bytes", "0"},
                                                                     {"licence", "1"},
                                                                     {"author", "null"},
                                                                     {"sha256", "\"00\""},
                                                                     {"url", "\"ftp://a/b\""}})
    EXPECT_THAT(error_of(Entry(key, value)),
                StartsWith("c.json: models[0]." + key + ": expected "));
  EXPECT_THAT(error_of(Entry("bytes", "1e9")), HasSubstr(".bytes: expected"));
  for (const char* text : {"", "[]", "{}", R"({"models": 1})"})
    EXPECT_THAT(error_of(text), HasSubstr("c.json: expected JSON"));
  EXPECT_THAT(error_of(R"({"models": [1]})"), HasSubstr("models[0]: expected an object"));
}

TEST(Digest, IsThatOfTheStandard) {  // FIPS 180-4, its example "abc"
  EXPECT_EQ(Sha256Of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Url, IsShownWithoutPassword) {
  EXPECT_EQ(WithoutPassword("http://u:p@a/b@c"), "http://a/b@c");
  EXPECT_EQ(WithoutPassword("http://u:p@a"), "http://a");
  EXPECT_EQ(WithoutPassword("https://a/b@c"), "https://a/b@c");
  EXPECT_EQ(WithoutPassword("rtsp://me:p@ss@10.0.0.2:554/live?q=a@b"),
            "rtsp://10.0.0.2:554/live?q=a@b");
  EXPECT_EQ(WithoutPassword("webcam:0"), "webcam:0");
}

}  // namespace
}  // namespace oaslam
