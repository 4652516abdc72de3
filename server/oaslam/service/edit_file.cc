#include "oaslam/service/edit_file.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <chrono>
#include <thread>

#include "oaslam/error.h"
#include "oaslam/service/map_store.h"
#include "oaslam/storage/map_rows.h"

namespace oaslam {
namespace {

constexpr int32_t kApplicationId = 0x4F415345;  // "OASE"
constexpr int32_t kFormatVersion = 1;

// The columns of an anchor are those of the map file (storage/map_schema.h). A removed anchor has
// a row, so that AnchorsSince can tell of it, with the columns of a default Anchor. The row with an
// empty name has the version at which the map was removed or replaced last.
constexpr const char* kSchema = R"sql(
CREATE TABLE versions(map TEXT PRIMARY KEY, version INTEGER) WITHOUT ROWID;
CREATE TABLE anchors(map TEXT, version INTEGER, name TEXT, is_removed INTEGER, model TEXT, size REAL, keyframe INTEGER,
  cam_from_anchor_qx REAL, cam_from_anchor_qy REAL, cam_from_anchor_qz REAL, cam_from_anchor_qw REAL,
  cam_from_anchor_tx REAL, cam_from_anchor_ty REAL, cam_from_anchor_tz REAL,
  object INTEGER, offset_x REAL, offset_y REAL, offset_z REAL, PRIMARY KEY(map, name)) WITHOUT ROWID;
CREATE INDEX anchors_by_version ON anchors(map, version);
)sql";
constexpr int kAnchorColumns = 18;

// The name of a map as SQL has it.
std::string Sql(const std::string& map) {
  CheckMapName(map);
  std::string quoted = "'";
  for (const char c : map) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

std::string IsMap(const std::string& map) { return "map = " + Sql(map); }

bool IsPassing(int error) {
  switch (error & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_NOMEM:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
      return true;
    default:
      return false;
  }
}

// Two processes that do this at the same time do not wait for each other: one is told that the file
// is busy, whatever its timeout is.
void UseWriteAheadLog(SQLite::Database& database) {
  for (int attempt = 0;; ++attempt) {
    const int result = database.tryExec("PRAGMA journal_mode = WAL");
    if ((result & 0xff) != SQLITE_BUSY) return database.check(result);
    if (attempt == 100)
      throw StoreUnavailable(database.getFilename() + ": " + database.getErrorMsg());
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace

template <typename Act>
auto EditFile::Try(Act act) {
  try {
    return act();
  } catch (const SQLite::Exception& error) {
    const std::string problem = database_.getFilename() + ": " + error.what();
    if (IsPassing(error.getErrorCode())) throw StoreUnavailable(problem);
    throw InputError(problem);
  }
}

EditFile::EditFile(const std::string& path) try
    : database_(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE | SQLite::OPEN_NOMUTEX, 5000) {
  UseWriteAheadLog(database_);
  Try([&] { Prepare(); });
} catch (const SQLite::Exception& error) {
  throw InputError(path + ": " + error.what());
}

void EditFile::Prepare() {
  SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
  const int64_t version = database_.execAndGet("PRAGMA user_version").getInt64();
  const int64_t tables = database_.execAndGet("SELECT count(*) FROM sqlite_master").getInt64();
  if (version == 0 && tables == 0) {
    database_.exec(kSchema);
    database_.exec(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}",
                               kApplicationId, kFormatVersion));
  } else if (database_.execAndGet("PRAGMA application_id").getInt() != kApplicationId) {
    throw SQLite::Exception("is no file of anchors");
  } else if (version > kFormatVersion) {
    throw SQLite::Exception(fmt::format(
        "was written by a newer version (format {}, this one reads {})", version, kFormatVersion));
  }
  if (const std::string found = database_.execAndGet("PRAGMA quick_check").getString();
      found != "ok")
    throw SQLite::Exception("is damaged: " + found);
  transaction.commit();
}

int64_t EditFile::NextVersion(const std::string& map) {
  return database_
      .execAndGet("INSERT INTO versions VALUES (" + Sql(map) +
                  ", 1) ON CONFLICT (map) DO UPDATE SET version = version + 1 RETURNING version")
      .getInt64();
}

AnchorEdits EditFile::AnchorsSince(const std::string& map, int64_t version) {
  return Try([&] {
    SQLite::Transaction transaction(database_);
    AnchorEdits edits;
    // max(): NULL, which is read as 0, for a map that has no edits.
    edits.version =
        database_.execAndGet("SELECT max(version) FROM versions WHERE " + IsMap(map)).getInt64();
    Checksum unused;
    RowReader rows(database_, unused, "anchors", "version",
                   fmt::format("{} AND version > {}", IsMap(map), version));
    while (rows.Next()) {
      rows.Text();  // the map
      const int64_t edited = rows.Integer(1, INT64_MAX);
      const std::string name = rows.Text();
      if (name.empty()) {
        edits.map_version = edited;
        continue;
      }
      AnchorEntry& entry = edits.entries.emplace_back(AnchorEntry{name, edited, {}});
      if (rows.Int(0, 1) == 0) entry.anchor = ReadAnchor(rows);
    }
    return edits;
  });
}

void EditFile::WriteAnchor(const std::string& map, int64_t version, const std::string& name,
                           const std::optional<Anchor>& anchor) {
  SQLite::Statement old(database_, "DELETE FROM anchors WHERE " + IsMap(map) + " AND name = ?");
  old.bind(1, name);
  old.exec();
  const Anchor a = anchor.value_or(Anchor());
  Checksum unused;
  RowWriter(database_, unused, "anchors", kAnchorColumns)
      .Write(std::string_view(map), version, std::string_view(name), anchor ? 0 : 1,
             std::string_view(a.model), a.size, a.keyframe, a.cam_from_anchor, a.object, a.offset);
}

std::optional<int64_t> EditFile::EditAnchor(const std::string& map, const std::string& name,
                                            const std::optional<Anchor>& anchor, bool must_be_new,
                                            const std::string& replaces) {
  CheckMapName(map);
  CheckAnchorEdit(name, anchor);
  return Try([&]() -> std::optional<int64_t> {
    SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
    if (must_be_new) {
      SQLite::Statement existing(database_, "SELECT 1 FROM anchors WHERE " + IsMap(map) +
                                                " AND name = ? AND is_removed = 0");
      existing.bind(1, name);
      if (existing.executeStep()) return std::nullopt;
    }
    const int64_t version = NextVersion(map);
    WriteAnchor(map, version, name, anchor);
    if (!replaces.empty()) WriteAnchor(map, version, replaces, std::nullopt);
    transaction.commit();
    return version;
  });
}

void EditFile::RemoveMap(const std::string& map) {
  Try([&] {
    SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
    database_.exec("DELETE FROM anchors WHERE " + IsMap(map));
    WriteAnchor(map, NextVersion(map), "", std::nullopt);
    transaction.commit();
  });
}

void EditFile::NoteReplacedMap(const std::string& map) {
  Try([&] {
    SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
    WriteAnchor(map, NextVersion(map), "", std::nullopt);
    transaction.commit();
  });
}

std::map<std::string, int64_t> EditFile::Versions() {
  return Try([&] {
    std::map<std::string, int64_t> versions;
    Checksum unused;
    RowReader rows(database_, unused, "versions", "map");
    while (rows.Next()) {
      std::string map = rows.Text();
      versions[std::move(map)] = rows.Integer(1, INT64_MAX);
    }
    return versions;
  });
}

int64_t EditFile::ChangesByOthers() {
  return Try([&] { return database_.execAndGet("PRAGMA data_version").getInt64(); });
}

}  // namespace oaslam
