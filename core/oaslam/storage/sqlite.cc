#include "oaslam/storage/sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "oaslam/util/check.h"

namespace oaslam {

void Checksum::Add(std::span<const std::byte> bytes) {
  Add(bytes.size());
  for (; bytes.size() >= sizeof(uint64_t); bytes = bytes.subspan(sizeof(uint64_t))) {
    uint64_t word;
    std::memcpy(&word, bytes.data(), sizeof word);
    Add(word);
  }
  for (const std::byte byte : bytes) Add(std::to_integer<uint64_t>(byte));
}

std::string Checksum::Hex() const { return fmt::format("{:016x}", state_); }

namespace {

constexpr const char* kWithoutLocks = "unix-none";  // a file system of SQLite's

}  // namespace

SQLite::Database OpenToRead(const std::string& path) {
  const int flags = SQLite::OPEN_READONLY | SQLite::OPEN_NOMUTEX;
  SQLite::Database database(path, flags);
  const int error = database.tryExec("PRAGMA schema_version") & 0xff;
  if (error != SQLITE_BUSY && error != SQLITE_PERM && error != SQLITE_IOERR) return database;
  return {path, flags, 0, kWithoutLocks};
}

SQLite::Database CreateWithoutLocks(const std::string& path) {
  return {path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE | SQLite::OPEN_NOMUTEX, 0,
          kWithoutLocks};
}

RowWriter::RowWriter(SQLite::Database& database, Checksum& checksum, const std::string& table,
                     int columns)
    : checksum_(checksum),
      statement_(database,
                 [&] {
                   std::string sql = "INSERT INTO " + table + " VALUES (?";
                   for (int i = 1; i < columns; ++i) sql += ",?";
                   return sql + ")";
                 }()),
      columns_(columns) {}

void RowWriter::Bind(int64_t value) {
  statement_.bind(++column_, value);
  checksum_.Add(SQLITE_INTEGER);
  checksum_.Add(static_cast<uint64_t>(value));
}

void RowWriter::Bind(double value) {
  OASLAM_CHECK(std::isfinite(value));
  value += 0.0;  // SQLite does not keep the sign of -0
  statement_.bind(++column_, value);
  checksum_.Add(SQLITE_FLOAT);
  checksum_.Add(std::bit_cast<uint64_t>(value));
}

void RowWriter::Bind(std::string_view text) {
  statement_.bind(++column_, std::string(text));
  checksum_.Add(SQLITE_TEXT);
  checksum_.Add(std::as_bytes(std::span(text)));
}

void RowWriter::Bind(std::span<const std::byte> blob) {
  // SQLite refuses blobs of more than 10^9 bytes, also where an int cannot tell their size.
  const auto size = static_cast<int>(std::min<size_t>(blob.size(), INT32_MAX));
  statement_.bindNoCopy(++column_, blob.empty() ? "" : static_cast<const void*>(blob.data()), size);
  checksum_.Add(SQLITE_BLOB);
  checksum_.Add(blob);
}

void RowWriter::Bind(const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) Bind(v[i]);
}

void RowWriter::Bind(const Eigen::Quaterniond& q) {
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) Bind(value);
}

void RowWriter::Bind(const Rigid3& pose) {
  Bind(pose.rotation);
  Bind(pose.translation);
}

void RowWriter::Bind(const Box& box) {
  for (const double value : {box.x1, box.y1, box.x2, box.y2}) Bind(value);
}

void RowWriter::Insert() {
  OASLAM_CHECK(column_ == columns_);
  statement_.exec();
  statement_.reset();
}

RowReader::RowReader(SQLite::Database& database, Checksum& checksum, const std::string& table,
                     const std::string& order, const std::string& where)
    : checksum_(checksum),
      table_(table),
      statement_(database,
                 fmt::format("SELECT * FROM {} WHERE {} ORDER BY {}", table, where, order)) {}

void RowReader::Refuse(const std::string& problem) const {
  const bool has_name = column_ > 0 && column_ <= statement_.getColumnCount();
  throw SQLite::Exception(fmt::format("table {}, column {}: {}", table_,
                                      has_name ? statement_.getColumnName(column_ - 1) : "?",
                                      problem));
}

bool RowReader::Next() {
  column_ = 0;
  return statement_.executeStep();
}

SQLite::Column RowReader::NextColumn(int type) {
  SQLite::Column column = statement_.getColumn(column_++);
  if (column.getType() != type) Refuse("a value of another type");
  checksum_.Add(static_cast<uint64_t>(type));
  return column;
}

int64_t RowReader::Integer(int64_t min, int64_t max) {
  const int64_t value = NextColumn(SQLITE_INTEGER).getInt64();
  checksum_.Add(static_cast<uint64_t>(value));
  if (value < min || value > max) Refuse(fmt::format("{}, allowed: {} to {}", value, min, max));
  return value;
}

double RowReader::Real() {
  const double value = NextColumn(SQLITE_FLOAT).getDouble();
  checksum_.Add(std::bit_cast<uint64_t>(value));
  if (!std::isfinite(value)) Refuse("not finite");
  return value;
}

float RowReader::Float() {
  const double value = Real();
  if (std::abs(value) > std::numeric_limits<float>::max()) Refuse("too large");
  return static_cast<float>(value);
}

std::string RowReader::Text() {
  const std::string text = NextColumn(SQLITE_TEXT).getString();
  checksum_.Add(std::as_bytes(std::span(text)));
  return text;
}

std::span<const std::byte> RowReader::BlobOfAnySize() {
  const SQLite::Column column = NextColumn(SQLITE_BLOB);
  const std::span blob(static_cast<const std::byte*>(column.getBlob()),
                       static_cast<size_t>(column.getBytes()));
  checksum_.Add(blob);
  return blob;
}

std::span<const std::byte> RowReader::Blob(size_t size) {
  const std::span<const std::byte> blob = BlobOfAnySize();
  if (blob.size() != size) Refuse(fmt::format("{} bytes, expected {}", blob.size(), size));
  return blob;
}

Eigen::Vector3d RowReader::Vector() {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v[i] = Real();
  return v;
}

Eigen::Quaterniond RowReader::Rotation() {
  Eigen::Quaterniond q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = Real();  // Eigen keeps x y z w
  if (!Rigid3::IsUnit(q)) Refuse(fmt::format("quaternion of length {}, expected 1", q.norm()));
  return q;
}

Rigid3 RowReader::Pose() {
  const Eigen::Quaterniond rotation = Rotation();
  return {rotation, Vector()};
}

Box RowReader::ReadBox() {
  Box box;
  for (double* value : {&box.x1, &box.y1, &box.x2, &box.y2}) *value = Real();
  return box;
}

}  // namespace oaslam
