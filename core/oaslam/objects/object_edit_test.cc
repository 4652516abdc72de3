#include "oaslam/objects/object_edit.h"

#include <gtest/gtest.h>

#include <memory>

#include "expect_input_error.h"
#include "oaslam/objects/object_mapper.h"
#include "object_table.h"

namespace oaslam {
namespace {

using testing::HasSubstr;

// Four things on a table, detected in a film of 100 images.
class ObjectEditTest : public testing::Test {
 protected:
  ObjectEditTest() {
    std::vector<object_table::TrueObject> table = object_table::TableTop();
    const auto film = object_table::Film(table, 100, {1, 0, 0}, 7);
    const auto features = std::make_shared<const Features>();
    for (uint32_t k = 0; k < 100; ++k) {
      map_.keyframes.Insert(
          KeyframeId(k),
          {static_cast<int>(k), k / 30.0, 0, film[k].cam_from_world, features, {}, {}});
      std::vector<ObjectSighting> sightings;
      for (uint32_t d = 0; d < film[k].detections.size(); ++d) {
        ObjectSighting seen;
        seen.object = ObjectId(d);
        seen.category_id = film[k].detections[d].category_id;
        seen.timestamp = k / 30.0;
        seen.is_new = k == 0;
        seen.observation = {static_cast<int>(k),       KeyframeId(k), Rigid3(), 0,
                            film[k].detections[d].box, 0.8,           0};
        sightings.push_back(seen);
      }
      UpdateObjects(map_, sightings, {static_cast<int>(k), k / 30.0}, {});
    }
  }

  Map map_ = object_table::EmptyMap();
  const ObjectsConfig config_{};
};

TEST_F(ObjectEditTest, RenamesAndRemoves) {
  const size_t objects = map_.objects.size();
  EditObject(map_, ObjectId(0), {.name = "my mug"}, config_);
  EXPECT_EQ(map_.objects.At(ObjectId(0)).name, "my mug");
  EditObject(map_, ObjectId(0), {.name = ""}, config_);
  EXPECT_EQ(map_.objects.At(ObjectId(0)).name, "");
  EditObject(map_, ObjectId(0), {.remove = true}, config_);
  EXPECT_EQ(map_.objects.size(), objects - 1);
  EXPECT_FALSE(map_.ResolveObject(ObjectId(0)));
}

TEST_F(ObjectEditTest, WhatCannotBeChangesNothing) {
  const Map before = map_;
  constexpr ObjectId kCup(0), kBook(2);
  ASSERT_NE(map_.objects.At(kCup).category_id, map_.objects.At(kBook).category_id);
  const auto refused = [&](ObjectId id, const ObjectEdit& edit, const char* why) {
    EXPECT_INPUT_ERROR(EditObject(map_, id, edit, config_), HasSubstr(why));
    EXPECT_EQ(map_.objects.At(kCup).name, before.objects.At(kCup).name);
    EXPECT_EQ(map_.objects.size(), before.objects.size());
  };
  refused(ObjectId(77), {.name = "x"}, "no object 77");
  refused(kCup, {.name = "a\nb"}, "control character");
  refused(kCup, {.name = "x", .same_as = ObjectId(77)}, "no object 77");
  refused(kCup, {.name = "x", .same_as = kCup}, "both ids are of one object");
  refused(kCup, {.name = "x", .same_as = kBook}, "two classes");
}

}  // namespace
}  // namespace oaslam
