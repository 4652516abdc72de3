#include "oaslam/storage/sqlite.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

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

Database::Database(std::string path, Access access) : path_(std::move(path)) {
  const int flags = access == Access::kReadOnly ? SQLITE_OPEN_READONLY
                                                : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* handle = nullptr;
  const int result = sqlite3_open_v2(path_.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  if (result != SQLITE_OK) Refuse(sqlite3_errstr(result));
}

Database::Database(std::string name) : path_(std::move(name)) {
  sqlite3* handle = nullptr;
  const int result =
      sqlite3_open_v2(":memory:", &handle,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  if (result != SQLITE_OK) Refuse(sqlite3_errstr(result));
}

Database::Database(std::string name, std::span<const std::byte> content)
    : Database(std::move(name)) {
  auto* copy = static_cast<unsigned char*>(sqlite3_malloc64(content.size()));
  if (!copy) Refuse("is too large for the memory");
  std::memcpy(copy, content.data(), content.size());
  const auto size = static_cast<sqlite3_int64>(content.size());
  const unsigned flags = SQLITE_DESERIALIZE_FREEONCLOSE |
                         SQLITE_DESERIALIZE_READONLY;  // SQLite frees the copy, also if it fails
  if (const int result = sqlite3_deserialize(handle(), "main", copy, size, size, flags);
      result != SQLITE_OK)
    Refuse(sqlite3_errstr(result));
}

std::vector<std::byte> Database::Content() const {
  sqlite3_int64 size = 0;
  const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> content(
      sqlite3_serialize(handle(), "main", &size, 0), &sqlite3_free);
  if (!content) Refuse("is too large for the memory");
  const auto bytes = std::as_bytes(std::span(content.get(), static_cast<size_t>(size)));
  return {bytes.begin(), bytes.end()};
}

void Database::Refuse(const std::string& problem) const { throw DatabaseError(path_, problem); }

void Database::Execute(const std::string& sql) {
  if (sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    Refuse(sqlite3_errmsg(handle()));
}

int64_t Database::QueryInteger(const std::string& sql) {
  Statement statement(*this, sql);
  return statement.Step() ? sqlite3_column_int64(statement.handle(), 0) : 0;
}

std::string Database::QueryText(const std::string& sql) {
  Statement statement(*this, sql);
  if (!statement.Step()) return {};
  const unsigned char* text = sqlite3_column_text(statement.handle(), 0);
  return text ? reinterpret_cast<const char*>(text) : "";
}

Statement::Statement(Database& database, const std::string& sql) : database_(&database) {
  sqlite3_stmt* handle = nullptr;
  if (sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &handle, nullptr) != SQLITE_OK)
    database.Refuse(sqlite3_errmsg(database.handle()));
  handle_.reset(handle);
}

bool Statement::Step() {
  const int result = sqlite3_step(handle());
  if (result != SQLITE_ROW && result != SQLITE_DONE)
    database_->Refuse(sqlite3_errmsg(database_->handle()));
  return result == SQLITE_ROW;
}

RowWriter::RowWriter(Database& database, Checksum& checksum, const std::string& table, int columns)
    : checksum_(checksum),
      statement_(database,
                 [&] {
                   std::string sql = "INSERT INTO " + table + " VALUES (?";
                   for (int i = 1; i < columns; ++i) sql += ",?";
                   return sql + ")";
                 }()),
      columns_(columns) {}

void RowWriter::Bind(int64_t value) {
  sqlite3_bind_int64(statement_.handle(), ++column_, value);
  checksum_.Add(SQLITE_INTEGER);
  checksum_.Add(static_cast<uint64_t>(value));
}

void RowWriter::Bind(double value) {
  OASLAM_CHECK(std::isfinite(value));
  value += 0.0;  // SQLite does not keep the sign of -0
  sqlite3_bind_double(statement_.handle(), ++column_, value);
  checksum_.Add(SQLITE_FLOAT);
  checksum_.Add(std::bit_cast<uint64_t>(value));
}

void RowWriter::Bind(std::string_view text) {
  sqlite3_bind_text(statement_.handle(), ++column_, text.data(), static_cast<int>(text.size()),
                    SQLITE_TRANSIENT);
  checksum_.Add(SQLITE_TEXT);
  checksum_.Add(std::as_bytes(std::span(text)));
}

void RowWriter::Bind(std::span<const std::byte> blob) {
  sqlite3_bind_blob64(statement_.handle(), ++column_,
                      blob.empty() ? "" : static_cast<const void*>(blob.data()), blob.size(),
                      SQLITE_TRANSIENT);
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
  statement_.Step();
  sqlite3_reset(statement_.handle());
}

RowReader::RowReader(Database& database, Checksum& checksum, const std::string& table,
                     const std::string& order, const std::string& where)
    : checksum_(checksum),
      table_(table),
      statement_(database,
                 fmt::format("SELECT * FROM {} WHERE {} ORDER BY {}", table, where, order)) {}

void RowReader::Refuse(const std::string& problem) const {
  const char* name = column_ > 0 ? sqlite3_column_name(statement_.handle(), column_ - 1) : nullptr;
  statement_.database().Refuse(
      fmt::format("table {}, column {}: {}", table_, name ? name : "?", problem));
}

bool RowReader::Next() {
  column_ = 0;
  return statement_.Step();
}

int RowReader::NextColumn(int type) {
  const int column = column_++;
  if (sqlite3_column_type(statement_.handle(), column) != type) Refuse("a value of another type");
  checksum_.Add(static_cast<uint64_t>(type));
  return column;
}

int64_t RowReader::Integer(int64_t min, int64_t max) {
  const int64_t value = sqlite3_column_int64(statement_.handle(), NextColumn(SQLITE_INTEGER));
  checksum_.Add(static_cast<uint64_t>(value));
  if (value < min || value > max) Refuse(fmt::format("{}, allowed: {} to {}", value, min, max));
  return value;
}

double RowReader::Real() {
  const double value = sqlite3_column_double(statement_.handle(), NextColumn(SQLITE_FLOAT));
  checksum_.Add(std::bit_cast<uint64_t>(value));
  if (!std::isfinite(value)) Refuse("not finite");
  return value;
}

std::string RowReader::Text() {
  const int column = NextColumn(SQLITE_TEXT);
  const auto* data =
      reinterpret_cast<const char*>(sqlite3_column_text(statement_.handle(), column));
  const std::string text(data,
                         static_cast<size_t>(sqlite3_column_bytes(statement_.handle(), column)));
  checksum_.Add(std::as_bytes(std::span(text)));
  return text;
}

std::span<const std::byte> RowReader::BlobOfAnySize() {
  const int column = NextColumn(SQLITE_BLOB);
  const auto* data =
      static_cast<const std::byte*>(sqlite3_column_blob(statement_.handle(), column));
  const auto bytes = static_cast<size_t>(sqlite3_column_bytes(statement_.handle(), column));
  checksum_.Add(std::span(data, bytes));
  return {data, bytes};
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
  if (std::abs(q.norm() - 1) > 1e-3)
    Refuse(fmt::format("quaternion of length {}, expected 1", q.norm()));
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
