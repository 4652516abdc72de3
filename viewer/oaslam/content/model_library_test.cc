#include "oaslam/content/model_library.h"

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

std::string Gltf(const std::string& buffer,
                 const std::string& image = "data:image/png;base64,AAAA") {
  return R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": ")" + buffer +
         R"("}], "images": [{"uri": ")" + image + R"("}]})";
}

struct ModelLibraryTest : FolderTest {};

TEST_F(ModelLibraryTest, HasBuiltInModels) {
  const ModelLibrary library;
  EXPECT_THAT(library.names(), ElementsAre("flag", "arrow", "cube", "tree", "robot"));
  EXPECT_EQ(library.entry("flag"), "flag/flag.glb");
  for (const std::string& name : library.names()) {
    const auto file = library.Find(library.entry(name));
    ASSERT_TRUE(file);
    EXPECT_EQ(file->content_type, "model/gltf-binary");
    EXPECT_EQ(file->bytes.substr(0, 8), std::string("glTF\2\0\0\0", 8)) << name;
    uint32_t size = 0;
    std::memcpy(&size, file->bytes.data() + 8, sizeof size);
    EXPECT_EQ(size, file->bytes.size()) << name;
  }
}

TEST_F(ModelLibraryTest, HandsOutWhatAModelRefersToAndNothingElse) {
  folder.Write("secret.txt", "secret");
  folder.Write("models/secret.bin", "secret");
  folder.Write("models/my lamp.bin", "four");
  folder.Write("models/maps/wood.png", "png");
  const std::string lamp =
      folder.Write("models/lamp.gltf", Gltf("my%20lamp.bin", "./maps/wood.png"));
  const std::string chair = folder.Write("models/my chair.glb", "glTF");
  const ModelLibrary library({lamp, chair});
  EXPECT_THAT(library.names(),
              ElementsAre("flag", "arrow", "cube", "tree", "robot", "lamp", "my chair"));
  EXPECT_EQ(library.entry("lamp"), "lamp/lamp.gltf");
  EXPECT_EQ(library.entry("my chair"), "my%20chair/my%20chair.glb");
  EXPECT_EQ(library.Find("lamp/lamp.gltf").value().content_type, "model/gltf+json");
  EXPECT_EQ(library.Find("lamp/my lamp.bin").value().path, folder / "models/my lamp.bin");
  EXPECT_EQ(library.Find("lamp/my%20lamp.bin").value().content_type, "application/octet-stream");
  EXPECT_EQ(library.Find("lamp/maps/wood.png").value().content_type, "image/png");
  EXPECT_TRUE(library.Find("my%20chair/my%20chair.glb"));
  for (const char* path :
       {"", "lamp", "lamp/", "lamp/secret.bin", "secret.bin", "lamp/../secret.txt",
        "lamp/%2e%2e/secret.txt", "lamp/%2e%2e%2fsecret.txt", "/etc/passwd", "lamp//etc/passwd",
        "lamp/maps", "lamp/maps/../my lamp.bin", "chair/my lamp.bin", "flag/lamp.gltf"})
    EXPECT_FALSE(library.Find(path)) << path;
}

TEST_F(ModelLibraryTest, RefusesWhatItCannotHandOut) {
  folder.Write("secret.bin", "secret");
  const auto refusal = [](const std::vector<std::string>& files) {
    return InputErrorOf([&] { const ModelLibrary library(files); });
  };
  EXPECT_THAT(refusal({folder / "nowhere.glb"}), HasSubstr("nowhere.glb: there is no such file"));
  EXPECT_THAT(refusal({folder.Write("lamp.obj", "")}), HasSubstr("allowed: .glb, .gltf"));
  EXPECT_THAT(refusal({folder.Write("flag.glb", "")}),
              HasSubstr("of the name flag already, a built-in one"));
  const std::string lamp = folder.Write("lamp.glb", "");
  EXPECT_THAT(refusal({lamp, lamp}), HasSubstr("of the name lamp already: " + lamp));
  EXPECT_THAT(refusal({folder.Write("noise.gltf", "noise")}),
              HasSubstr("noise.gltf: not a glTF file"));
  EXPECT_THAT(refusal({folder.Write("list.gltf", R"({"buffers": 3})")}),
              HasSubstr("buffers: not a list"));
  for (const char* uri : {"/etc/passwd", "http://example.org/a.bin", "file:///etc/passwd",
                          "%2fetc/passwd", "C:a.bin"})
    EXPECT_THAT(refusal({folder.Write("in/a.gltf", Gltf(uri))}), HasSubstr("an absolute address"))
        << uri;
  for (const char* uri : {"../secret.bin", "%2e%2e/secret.bin", "b/../../secret.bin"})
    EXPECT_THAT(refusal({folder.Write("in/a.gltf", Gltf(uri))}),
                HasSubstr("leads out of its folder"))
        << uri;
  EXPECT_THAT(refusal({folder.Write("in/a.gltf", Gltf("gone.bin"))}),
              HasSubstr("buffers: uri gone.bin: there is no such file"));
}

}  // namespace
}  // namespace oaslam
