#include "oaslam/class_names.h"

#include "expect_input_error.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

class ClassFile : public testing::Test {
 protected:
  Classes Load(const std::string& text, const std::string& name = "c.yaml") const {
    return LoadClasses(folder_.Write(name, text));
  }
  std::string Error(const std::string& text, const std::string& name = "c.yaml") const {
    return InputErrorOf([&] { Load(text, name); });
  }
  TempFolder folder_;
};

TEST_F(ClassFile, CocoYamlListAndText) {
  EXPECT_THAT(CocoClassNames(), SizeIs(80));
  EXPECT_EQ(NameOf(CocoClassNames(), 41), "cup");
  EXPECT_EQ(NameOf(CocoClassNames(), 79), "toothbrush");
  EXPECT_EQ(NameOf(CocoClassNames(), 80), "class 80");
  EXPECT_EQ(NameOf(Load("names: {41: mug, 7: statue}\n").names, 7), "statue");
  EXPECT_EQ(NameOf(Load("nc: 2\npath: data\nnames: [bird, stone]\n").names, 1), "stone");
  EXPECT_EQ(NameOf(Load("names: [bird, stone]\n", "names.txt").names, 1), "stone");
  EXPECT_EQ(NameOf(Load("bird\n\ngrey stone\n", "c.txt").names, 1), "grey stone");
  EXPECT_TRUE(Load("names: [bird]\n").relations.Empty());
}

TEST_F(ClassFile, BadNamesAreRefused) {
  EXPECT_THAT(Error("names: {x: mug}\n"), HasSubstr("expected a number"));
  EXPECT_THAT(Error("nc: 1\n"), HasSubstr("\"names\" is missing"));
  EXPECT_THAT(Error("names: 7\n"), HasSubstr("expected {41: cup}"));
  EXPECT_THAT(Error("names: {}\n"), HasSubstr("no class names"));
  EXPECT_THAT(Error("\n", "f.txt"), HasSubstr("no class names"));
  EXPECT_THAT(Error("names: [a]\nmovabel: [a]\n"),
              HasSubstrs("c.yaml:2", "movabel", "nearest is movable"));
}

TEST_F(ClassFile, PartsAndMovables) {
  const ClassRelations r = Load(
                               "names: {0: person, 100: head, 101: statue, 102: nose}\nparts: "
                               "{head: statue, nose: head}\nmovable: [person]\n")
                               .relations;
  EXPECT_THAT(r.whole_of, ElementsAre(Pair(100, 101), Pair(102, 100)));
  EXPECT_THAT(r.movable, ElementsAre(0));
  EXPECT_TRUE(r.IsPartOf(100, 101));
  EXPECT_TRUE(r.IsPartOf(102, 101));
  EXPECT_FALSE(r.IsPartOf(101, 100));
  EXPECT_FALSE(r.IsPartOf(101, 101));
  EXPECT_TRUE(r.IsMovable(0));
  EXPECT_FALSE(r.IsMovable(102));
}

TEST_F(ClassFile, PartsOfWhatMovesMove) {
  const ClassRelations r = Load(
                               "names: [person, face, nose, cup]\nparts: {face: person, nose: "
                               "face}\nmovable: [person]\n")
                               .relations;
  EXPECT_TRUE(r.IsMovable(2));
  EXPECT_FALSE(r.IsMovable(3));
}

TEST_F(ClassFile, RelationsWithoutNamesAreOfCoco) {
  EXPECT_THAT(Load("movable: [person, chair]\n").relations.movable, ElementsAre(0, 56));
  EXPECT_THAT(Load("names: [a]\nmovable:\nparts:\n").relations.movable, IsEmpty());
}

TEST_F(ClassFile, BadRelationsAreRefused) {
  const std::string names = "names: [head, statue, person]\n";
  EXPECT_THAT(Error(names + "movable: [preson]\n"),
              HasSubstrs("movable", "\"preson\"", "\"person\""));
  EXPECT_THAT(Error(names + "movable: person\n"), HasSubstr("expected [person, chair]"));
  EXPECT_THAT(Error(names + "movable: [[person]]\n"), HasSubstr("expected the name of a class"));
  EXPECT_THAT(Error(names + "parts: {head: statues}\n"), HasSubstrs("parts.head", "\"statue\""));
  EXPECT_THAT(Error(names + "parts: {haed: statue}\n"), HasSubstrs("parts", "\"head\""));
  EXPECT_THAT(Error(names + "parts: [head]\n"), HasSubstr("expected {head: statue}"));
  EXPECT_THAT(Error(names + "parts: {head: [statue, person]}\n"),
              HasSubstr("expected the name of a class"));
  EXPECT_THAT(Error(names + "parts: {head: head}\n"), HasSubstr("head is a part of itself"));
  EXPECT_THAT(Error(names + "parts: {head: statue, statue: person, person: head}\n"),
              HasSubstr("is a part of itself"));
  EXPECT_THAT(Error("names: [head, statue, statue]\nparts: {head: statue}\n"),
              HasSubstr("several classes"));
}

}  // namespace
}  // namespace oaslam
