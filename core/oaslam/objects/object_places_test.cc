#include "oaslam/objects/object_places.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

Object At(double x, ObjectState state) {
  Object object;
  object.category_id = 41;
  object.state = state;
  object.ellipsoid.center = {x, 0, 0};
  object.ellipsoid.half_axes = {0.1, 0.3, 0.2};
  return object;
}

TEST(ObjectPlaces, FollowTheTable) {
  Table<ObjectId, Object> objects;
  objects.Insert(ObjectId(3), At(3, ObjectState::kMapped));
  objects.Insert(ObjectId(70), At(70, ObjectState::kInitialized));
  objects.Insert(ObjectId(71), At(71, ObjectState::kTentative));
  ObjectPlaces places;
  places.Update(objects);
  EXPECT_EQ(PlacesOf(objects).size(), 2U);
  ASSERT_EQ(places.all().size(), 2U);  // a tentative object has no place
  EXPECT_TRUE(places.all()[0].is_mapped);
  EXPECT_EQ(places.all()[0].radius, 0.3);
  EXPECT_FALSE(places.all()[1].is_mapped);

  objects.Erase(ObjectId(3));
  objects.MutableAt(ObjectId(70)).ellipsoid.center.x() = 7;
  objects.MutableAt(ObjectId(71)).state = ObjectState::kMapped;
  objects.Insert(ObjectId(5), At(5, ObjectState::kMapped));
  places.Update(objects);
  ASSERT_EQ(places.all().size(), 3U);
  EXPECT_EQ(places.all()[0].id, ObjectId(5));  // ascending
  EXPECT_EQ(places.all()[1].center.x(), 7);
  EXPECT_EQ(places.all()[2].id, ObjectId(71));

  places.Update({});
  EXPECT_TRUE(places.all().empty());
}

}  // namespace
}  // namespace oaslam
