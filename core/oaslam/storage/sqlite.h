#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// FNV-1a (Fowler, Noll, Vo), taking a word of 64 bits at a time, over types and values in order.
class Checksum {
 public:
  void Add(uint64_t word) { state_ = Mix(state_ ^ word); }
  void Add(std::span<const std::byte> bytes);
  std::string Hex() const;

 private:
  // The shift moves the high bits down, which multiplication alone does not.
  static uint64_t Mix(uint64_t v) {
    v *= 0x100000001b3ULL;
    return v ^ (v >> 32);
  }
  uint64_t state_ = 0xcbf29ce484222325ULL;
};

// Errors of the database, and of what is in it, are a SQLite::Exception without the path: whoever
// opens a file turns it into an InputError that names the path.

// Map files are replaced as a whole and never changed in place, so that they can be read and
// written without SQLite's locks, which some network drives do not have.
SQLite::Database OpenToRead(const std::string& path);
SQLite::Database CreateWithoutLocks(const std::string& path);

// Inserts rows into a table, its columns in order, and adds them to the checksum. A Rigid3 is seven
// columns (qx qy qz qw tx ty tz).
class RowWriter {
 public:
  RowWriter(SQLite::Database& database, Checksum& checksum, const std::string& table, int columns);

  template <typename... Values>
  void Write(const Values&... values) {
    column_ = 0;
    (Bind(values), ...);
    Insert();
  }

 private:
  void Bind(int64_t value);
  void Bind(int value) { Bind(static_cast<int64_t>(value)); }
  void Bind(uint32_t value) { Bind(static_cast<int64_t>(value)); }
  template <typename Tag>
  void Bind(StrongId<Tag> id) {
    Bind(id.IsValid() ? static_cast<int64_t>(id.value) : -1);
  }
  void Bind(double value);
  void Bind(std::string_view text);
  void Bind(std::span<const std::byte> blob);
  void Bind(const Eigen::Vector3d& v);
  void Bind(const Eigen::Quaterniond& q);
  void Bind(const Rigid3& pose);
  void Bind(const Box& box);
  void Insert();

  Checksum& checksum_;
  SQLite::Statement statement_;
  int column_ = 0, columns_;
};

// Reads the rows of a table in order, column by column, and adds them to the checksum. A value of a
// wrong type or out of range is a SQLite::Exception that names table and column.
class RowReader {
 public:
  static constexpr uint32_t kMaxId = 100'000'000;  // so that a wrong id cannot ask for all memory

  RowReader(SQLite::Database& database, Checksum& checksum, const std::string& table,
            const std::string& order, const std::string& where = "1");

  bool Next();
  int64_t Integer(int64_t min, int64_t max);
  int Int(int min = INT32_MIN, int max = INT32_MAX) { return static_cast<int>(Integer(min, max)); }
  template <typename Id>
  Id RequiredId() {
    return Id(static_cast<uint32_t>(Integer(0, kMaxId)));
  }
  template <typename Id>
  Id OptionalId() {
    const int64_t value = Integer(-1, kMaxId);
    return value < 0 ? Id() : Id(static_cast<uint32_t>(value));
  }
  double Real();  // finite
  float Float();  // finite
  std::string Text();
  std::span<const std::byte> Blob(size_t size);  // valid until Next()
  std::span<const std::byte> BlobOfAnySize();    // likewise
  Eigen::Vector3d Vector();
  Eigen::Quaterniond Rotation();
  Rigid3 Pose();
  Box ReadBox();
  [[noreturn]] void Refuse(const std::string& problem) const;

 private:
  SQLite::Column NextColumn(int type);

  Checksum& checksum_;
  std::string table_;
  SQLite::Statement statement_;
  int column_ = 0;
};

}  // namespace oaslam
