#include "oaslam/map/table.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "oaslam/ids.h"

namespace oaslam {
namespace {

TEST(Table, ACopyIsAValue) {
  Table<LandmarkId, int> table;
  for (uint32_t i = 0; i < 200; ++i) table.Insert(LandmarkId(i), static_cast<int>(i));
  const Table<LandmarkId, int> snapshot = table;
  table.MutableAt(LandmarkId(7)) = -1;
  table.Erase(LandmarkId(8));
  table.Insert(LandmarkId(500), 5);
  EXPECT_EQ(snapshot.At(LandmarkId(7)), 7);
  EXPECT_EQ(snapshot.At(LandmarkId(8)), 8);
  EXPECT_FALSE(snapshot.Contains(LandmarkId(500)));
  EXPECT_EQ(snapshot.size(), 200U);
  EXPECT_EQ(table.At(LandmarkId(7)), -1);
  EXPECT_EQ(table.size(), 200U);
}

TEST(Table, BothSidesMayWriteAfterACopy) {
  Table<LandmarkId, int> a;
  a.Insert(LandmarkId(1), 1);
  Table<LandmarkId, int> b = a;
  b.MutableAt(LandmarkId(1)) = 2;
  a.MutableAt(LandmarkId(1)) = 3;
  EXPECT_EQ(a.At(LandmarkId(1)), 3);
  EXPECT_EQ(b.At(LandmarkId(1)), 2);
}

TEST(Table, TakesTheValuesOfAnother) {
  Table<LandmarkId, int> table, other;
  for (uint32_t i = 0; i < 100; ++i) table.Insert(LandmarkId(i), 1);  // a page and a half
  for (uint32_t i = 100; i < 300; i += 2) other.Insert(LandmarkId(i), 2);
  const Table<LandmarkId, int> before = table;
  table.Take(std::move(other));
  EXPECT_EQ(table.size(), 200U);
  EXPECT_EQ(before.size(), 100U);
  EXPECT_EQ(table.At(LandmarkId(99)), 1);
  EXPECT_EQ(table.At(LandmarkId(100)), 2);
  EXPECT_EQ(table.At(LandmarkId(298)), 2);
  EXPECT_FALSE(table.Contains(LandmarkId(101)));
}

// The pages of a table of which there is a copy are not taken, since the copy has them, too.
TEST(Table, TakingLeavesCopiesAlone) {
  Table<LandmarkId, int> table, other;
  other.Insert(LandmarkId(1), 1);
  const Table<LandmarkId, int> copy = other;
  table.Take(std::move(other));
  table.MutableAt(LandmarkId(1)) = 2;
  EXPECT_EQ(copy.At(LandmarkId(1)), 1);
  const Table<LandmarkId, int> snapshot = table;
  table.MutableAt(LandmarkId(1)) = 3;
  EXPECT_EQ(snapshot.At(LandmarkId(1)), 2);
}

// Values keep their places, so that pointers to them stay valid, and come in the order of ids.
TEST(Table, ValuesStayInPlace) {
  Table<LandmarkId, std::string> table;
  for (uint32_t i = 64; i > 0; --i) table.Insert(LandmarkId(i - 1), std::to_string(i - 1));
  const std::string* pointer = table.Find(LandmarkId(20));
  for (int round = 0; round < 3; ++round) {
    for (uint32_t i = 0; i < 64; ++i)
      if (i != 20) table.Erase(LandmarkId(i));
    for (uint32_t i = 0; i < 64; ++i)
      if (i != 20) table.Insert(LandmarkId(i), std::to_string(i));
  }
  EXPECT_EQ(table.Find(LandmarkId(20)), pointer);
  uint32_t next = 0;
  const Table<LandmarkId, std::string> copy = table;
  table.MutableAt(LandmarkId(3)) = "other";
  copy.ForEach([&](LandmarkId id, const std::string& value) {
    EXPECT_EQ(id.value, next++);
    EXPECT_EQ(value, std::to_string(id.value));
  });
  EXPECT_EQ(next, 64U);
}

TEST(Table, SharesPagesNobodyWrote) {
  Table<LandmarkId, int> table;
  for (uint32_t i = 0; i < 128; ++i) table.Insert(LandmarkId(i), 0);
  const Table<LandmarkId, int> snapshot = table;
  table.MutableAt(LandmarkId(3)) = 1;
  EXPECT_NE(snapshot.Find(LandmarkId(3)), table.Find(LandmarkId(3)));
  EXPECT_EQ(snapshot.Find(LandmarkId(100)), table.Find(LandmarkId(100)));
}

TEST(Table, DifferencesAreWhatWasEdited) {
  Table<LandmarkId, int> table;
  for (uint32_t i = 0; i < 300; ++i) table.Insert(LandmarkId(i), 0);
  const Table<LandmarkId, int> earlier = table;
  table.MutableAt(LandmarkId(3)) = 1;
  table.Erase(LandmarkId(70));
  table.Insert(LandmarkId(1000), 5);
  std::vector<uint32_t> changed, gone, visited;
  table.ForEachDifference(earlier, [&](LandmarkId id, const int* before, const int* now) {
    visited.push_back(id.value);
    if (!now)
      gone.push_back(id.value);
    else if (!before || *before != *now)
      changed.push_back(id.value);
  });
  EXPECT_EQ(changed, (std::vector{3U, 1000U}));
  EXPECT_EQ(gone, std::vector{70U});
  EXPECT_EQ(visited.size(), 2 * 64U + 1);  // the pages of 3 and 70, and 1000
  table.ForEachDifference(table, [](LandmarkId, const int*, const int*) { FAIL(); });
}

TEST(Table, IteratesInOrderOfIds) {
  Table<LandmarkId, int> table;
  for (const uint32_t i : {300U, 2U, 77U}) table.Insert(LandmarkId(i), 0);
  EXPECT_EQ(table.Ids(), (std::vector{LandmarkId(2), LandmarkId(77), LandmarkId(300)}));
}

// A defect of the program ends the present operation, not the program.
TEST(Table, WhatIsNotThereIsSaidByAnException) {
  Table<LandmarkId, int> table;
  table.Insert(LandmarkId(1), 1);
  EXPECT_THROW(table.At(LandmarkId(2)), std::logic_error);
  EXPECT_THROW(table.Insert(LandmarkId(1), 2), std::logic_error);
  EXPECT_EQ(table.At(LandmarkId(1)), 1);
}

}  // namespace
}  // namespace oaslam
