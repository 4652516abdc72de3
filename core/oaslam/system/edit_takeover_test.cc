#include "oaslam/system/edit_takeover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "matchers.h"
#include "oaslam/objects/object_edit.h"
#include "object_table.h"

namespace oaslam {
namespace {

// A cup that was mapped twice, a second one, and a book, seen by twenty keyframes; an anchor on the
// book and one beside it. The tests edit `now_` as users do in the file, and `map_` as the program
// does that has read the same.
class EditTakeoverTest : public testing::Test {
 protected:
  static constexpr ObjectId kCup{0}, kSameCup{1}, kOtherCup{2}, kBook{3};

  EditTakeoverTest() {
    const std::vector<object_table::TrueObject> table = object_table::TableTop();
    for (uint32_t k = 0; k < 20; ++k) {
      Keyframe keyframe;
      keyframe.frame_index = static_cast<int>(k);
      keyframe.cam_from_world = object_table::LookAt(
          {1.4 * std::cos(0.1 * k), 1.4 * std::sin(0.1 * k), 0.7}, {0, 0, 0.05});
      map_.keyframes.Insert(KeyframeId(k), keyframe);
    }
    const size_t things[] = {0, 0, 1, 2};
    for (size_t i = 0; i < std::size(things); ++i) {
      Object object = synthetic::WellMappedObject(table[things[i]]);
      map_.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
        if (id.value % 2 != i % 2) return;
        object.observations.push_back(
            {keyframe.frame_index, id, Rigid3(), 0,
             *ProjectToBox(object.ellipsoid, keyframe.cam_from_world, object_table::kCamera), 0.8});
      });
      object.total_observations = static_cast<int>(object.observations.size());
      synthetic::AddObject(map_, object);
    }
    map_.anchors["note"] = {"flag", 0.1, KeyframeId(3), {}, kBook, {0, 0, 0.1}};
    map_.anchors["tree"] = AnchorAt(5);
    now_ = map_;
    read_ = EditedContentOf(map_);
  }

  static Anchor AnchorAt(uint32_t keyframe, double size = 0.2) {
    return {
        "tree", size,     KeyframeId(keyframe), Rigid3(Rigid3::Rotation::Identity(), {0.1, 0.2, 1}),
        {},     {0, 0, 0}};
  }
  void Edit(Map& map, ObjectId id, const ObjectEdit& edit) const {
    EditObject(map, id, edit, config_);
  }
  std::string TakeOver() { return TakeOverEdits(read_, now_, config_, map_); }
  std::vector<std::string> AnchorNames() const {
    std::vector<std::string> names;
    for (const auto& [name, anchor] : map_.anchors) names.push_back(name);
    return names;
  }

  Map map_ = object_table::EmptyMap(), now_;
  EditedContent read_;
  const ObjectsConfig config_{};
};

TEST_F(EditTakeoverTest, WithoutEditsNothingChanges) {
  map_.anchors.erase("tree");
  Edit(map_, kCup, {.name = "mine"});
  EXPECT_EQ(TakeOver(), "");
  EXPECT_THAT(AnchorNames(), ElementsAre("note"));
  EXPECT_EQ(map_.objects.At(kCup).name, "mine");
}

TEST_F(EditTakeoverTest, AnchorsAreAddedChangedAndRemoved) {
  now_.anchors["new"] = AnchorAt(7);
  now_.anchors["note"].size = 3;
  now_.anchors.erase("tree");
  EXPECT_EQ(TakeOver(), "");
  EXPECT_THAT(AnchorNames(), ElementsAre("new", "note"));
  EXPECT_EQ(map_.anchors["new"], now_.anchors["new"]);
  EXPECT_EQ(map_.anchors["note"], now_.anchors["note"]);
}

TEST_F(EditTakeoverTest, ARenamedAnchorHasOneName) {
  now_.anchors["oak"] = now_.anchors["tree"];
  now_.anchors.erase("tree");
  EXPECT_EQ(TakeOver(), "");
  EXPECT_THAT(AnchorNames(), ElementsAre("note", "oak"));
}

// As a loop does: lengths at a keyframe, and anchors there, are multiplied.
TEST_F(EditTakeoverTest, AnchorsHaveTheLengthsOfTheirKeyframes) {
  map_.keyframes.MutableAt(KeyframeId(5)).unit = 1.5;
  map_.anchors["tree"].Scale(1.5);
  map_.retired.Insert(KeyframeId(40), {KeyframeId(5), {}, 2});
  now_.anchors["near"] = AnchorAt(5);
  now_.anchors["gone"] = AnchorAt(40);
  now_.anchors.erase("tree");  // which the program has only scaled
  EXPECT_EQ(TakeOver(), "");
  EXPECT_THAT(AnchorNames(), ElementsAre("gone", "near", "note"));
  EXPECT_DOUBLE_EQ(map_.anchors["near"].size, 0.3);
  EXPECT_DOUBLE_EQ(map_.anchors["near"].cam_from_anchor.translation.z(), 1.5);
  EXPECT_DOUBLE_EQ(map_.anchors["gone"].size, 0.4);
}

TEST_F(EditTakeoverTest, OfTwoEditsOfAnAnchorNoneIsLost) {
  for (const char* name : {"note", "new", "same"}) {
    map_.anchors[name] = AnchorAt(2);
    now_.anchors[name] = AnchorAt(6);
  }
  map_.anchors["same"] = AnchorAt(6);
  map_.anchors.erase("tree");
  now_.anchors["tree"].size = 4;
  EXPECT_EQ(TakeOver(), "");
  EXPECT_THAT(AnchorNames(), ElementsAre("new", "new (2)", "note", "note (2)", "same", "tree"));
  EXPECT_EQ(map_.anchors["new"], AnchorAt(2));
  EXPECT_EQ(map_.anchors["new (2)"], AnchorAt(6));
  EXPECT_EQ(map_.anchors["tree"].size, 4);
}

TEST_F(EditTakeoverTest, WhatOneRemovedAndTheOtherChangedStays) {
  map_.anchors["tree"].size = 4;
  now_.anchors.erase("tree");
  EXPECT_EQ(TakeOver(), "");
  EXPECT_EQ(map_.anchors.at("tree").size, 4);
}

TEST_F(EditTakeoverTest, ObjectsAreNamedAndRemoved) {
  Edit(now_, kCup, {.name = "my cup"});
  Edit(now_, kOtherCup, {.remove = true});
  map_.objects.MutableAt(kCup).ellipsoid.center.x() += 1;  // the map goes on
  EXPECT_EQ(TakeOver(), "");
  EXPECT_EQ(map_.objects.At(kCup).name, "my cup");
  EXPECT_NE(map_.objects.At(kCup).ellipsoid.center, now_.objects.At(kCup).ellipsoid.center);
  EXPECT_FALSE(map_.objects.Contains(kOtherCup));
  EXPECT_EQ(map_.objects.size(), 3u);
}

TEST_F(EditTakeoverTest, ObjectsAreMerged) {
  Edit(now_, kCup, {.name = "my cup", .same_as = kSameCup});
  EXPECT_EQ(TakeOver(), "");
  EXPECT_EQ(map_.ResolveObject(kSameCup), kCup);
  EXPECT_EQ(map_.objects.At(kCup).name, "my cup");
  EXPECT_THAT(map_.objects.At(kCup).observations, SizeIs(20));
}

// The program has found out itself that they are one.
TEST_F(EditTakeoverTest, AMergedObjectGetsTheNameOfEither) {
  Edit(map_, kCup, {.same_as = kSameCup});
  Edit(now_, kSameCup, {.name = "my cup"});
  EXPECT_EQ(TakeOver(), "");
  EXPECT_EQ(map_.objects.At(kCup).name, "my cup");
}

TEST_F(EditTakeoverTest, ARemovedDuplicateIsNotTheObjectItWasMergedWith) {
  Edit(map_, kCup, {.same_as = kSameCup});
  Edit(now_, kSameCup, {.remove = true});
  EXPECT_EQ(TakeOver(), "");
  EXPECT_TRUE(map_.objects.Contains(kCup));
}

TEST_F(EditTakeoverTest, ANameThatTheProgramGaveStays) {
  Edit(map_, kCup, {.name = "by the program"});
  Edit(now_, kCup, {.name = "by the file"});
  EXPECT_EQ(TakeOver(), "");
  EXPECT_EQ(map_.objects.At(kCup).name, "by the program");
}

TEST_F(EditTakeoverTest, WhatIsGoneNeedsNoEdit) {
  map_.objects.Erase(kOtherCup);
  map_.objects.Erase(kBook);
  Edit(now_, kOtherCup, {.name = "x"});
  Edit(now_, kBook, {.remove = true});
  EXPECT_EQ(TakeOver(), "");
  EXPECT_EQ(map_.objects.size(), 2u);
}

TEST_F(EditTakeoverTest, WhatCannotBeTakenOverChangesNothing) {
  Edit(now_, kCup, {.name = "my cup"});
  now_.anchors["new"] = AnchorAt(4);
  const Map complete = map_;
  const auto expect_refused = [&](const char* why) {
    EXPECT_THAT(TakeOver(), HasSubstr(why));
    EXPECT_EQ(map_.objects.At(kCup).name, "");
    EXPECT_THAT(AnchorNames(), ElementsAre("note", "tree"));
    map_ = complete;
  };
  map_.keyframes.Erase(KeyframeId(4));
  expect_refused("no keyframe 4");
  map_.is_metric = true;
  expect_refused("another unit");
  now_.anchors = read_.anchors;
  map_.is_metric = true;
  EXPECT_EQ(TakeOver(), "");
}

TEST_F(EditTakeoverTest, ObjectsThatCannotBeOneAnyMoreAreNotMerged) {
  Edit(now_, kCup, {.same_as = kSameCup});
  map_.objects.MutableAt(kSameCup).shares = {{73, 1}};
  map_.objects.MutableAt(kSameCup).category_id = 73;
  EXPECT_THAT(TakeOver(), HasSubstr("are not merged"));
}

}  // namespace
}  // namespace oaslam
