#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <span>

#include "oaslam/crypto/sha256.h"
#include "oaslam/service/database_watch.h"
#include "oaslam/service/map_store.h"
#include "oaslam/service/postgres.h"
#include "oaslam/service/private_folder.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr int kTablesVersion = 1;
// Bytes of a map file that are sent at a time: enough that the messages around them cost nothing,
// and small beside the memory of a map.
constexpr size_t kChunk = 1 << 20;

// A map file is in chunks, so that neither side has all of it in memory. The columns of an anchor
// are those of the map file (storage/map_schema.h); of a removed one they are those of a default
// Anchor. The row with an empty name has the version at which the map was removed or replaced last.
constexpr const char* kTables[] = {
    "CREATE TABLE IF NOT EXISTS oaslam_format(version integer NOT NULL)",
    "CREATE SEQUENCE IF NOT EXISTS oaslam_contents",
    R"sql(CREATE TABLE IF NOT EXISTS oaslam_maps(name text PRIMARY KEY, digest text NOT NULL, bytes bigint NOT NULL,
  changed double precision NOT NULL, content bigint NOT NULL))sql",
    R"sql(CREATE TABLE IF NOT EXISTS oaslam_chunks(map text NOT NULL, content bigint NOT NULL, number bigint NOT NULL,
  data bytea NOT NULL, PRIMARY KEY(content, number)))sql",
    "ALTER TABLE oaslam_chunks ALTER COLUMN data SET STORAGE EXTERNAL",  // it cannot be compressed
    "CREATE INDEX IF NOT EXISTS oaslam_chunks_by_map ON oaslam_chunks(map, content)",
    "CREATE TABLE IF NOT EXISTS oaslam_versions(map text PRIMARY KEY, version bigint NOT NULL)",
    R"sql(CREATE TABLE IF NOT EXISTS oaslam_anchors(map text, version bigint NOT NULL, name text, is_removed boolean NOT NULL,
  model text NOT NULL, size double precision NOT NULL, keyframe bigint NOT NULL,
  cam_from_anchor_qx double precision NOT NULL, cam_from_anchor_qy double precision NOT NULL,
  cam_from_anchor_qz double precision NOT NULL, cam_from_anchor_qw double precision NOT NULL,
  cam_from_anchor_tx double precision NOT NULL, cam_from_anchor_ty double precision NOT NULL,
  cam_from_anchor_tz double precision NOT NULL, object bigint NOT NULL,
  offset_x double precision NOT NULL, offset_y double precision NOT NULL, offset_z double precision NOT NULL,
  PRIMARY KEY(map, name)))sql",
    "CREATE INDEX IF NOT EXISTS oaslam_anchors_by_version ON oaslam_anchors(map, version)",
};

void CreateTables(PgConnection& connection) {
  PgTransaction transaction(connection);
  // Of servers that start at the same time, one creates the tables. The key of the lock is any
  // number that other programs are unlikely to use.
  connection.Run("SELECT pg_advisory_xact_lock(8390881223)");
  const PgRows known = connection.Run("SELECT to_regclass('oaslam_format') IS NOT NULL");
  if (known.Text(0, 0) == "t") {
    const PgRows version = connection.Run("SELECT max(version) FROM oaslam_format");
    if (version.Integer(0, 0) > kTablesVersion)
      throw BadInput(
          "database: its tables were made by a newer version (format {}, this one reads {})",
          version.Integer(0, 0), kTablesVersion);
    return;
  }
  for (const char* sql : kTables) connection.Run(sql);
  connection.Run("INSERT INTO oaslam_format VALUES ($1)", {int64_t{kTablesVersion}});
  transaction.Commit();
}

// The query for maps, of which MapOf and Receive take the columns.
std::string SelectMaps(const char* condition) {
  return fmt::format("SELECT name, digest, bytes, changed, content FROM oaslam_maps {}", condition);
}

StoredMap MapOf(const PgRows& rows, int row) {
  return {std::string(rows.Text(row, 0)), std::string(rows.Text(row, 1)),
          static_cast<uint64_t>(rows.Integer(row, 2)), rows.Real(row, 3)};
}

// The next version of a map's edits. Others that edit the same map wait until this transaction
// ends, and every server is told of the change then.
int64_t NextVersion(PgConnection& connection, const std::string& map) {
  connection.Run("SELECT pg_notify($1, $2)", {kChangesChannel, map});
  return connection
      .Run(
          "INSERT INTO oaslam_versions VALUES ($1, 1) ON CONFLICT (map) DO UPDATE SET version = "
          "oaslam_versions.version + 1 RETURNING version",
          {map})
      .Integer(0, 0);
}

Anchor AnchorOf(const PgRows& rows, int row, int column) {
  const auto real = [&] { return rows.Real(row, column++); };
  const auto id = [&] {
    const int64_t value = rows.Integer(row, column++);
    return value < 0 ? UINT32_MAX : static_cast<uint32_t>(value);
  };
  const auto vector = [&] {
    Eigen::Vector3d v;
    for (double& x : v) x = real();
    return v;
  };
  Anchor anchor;
  anchor.model = rows.Text(row, column++);
  anchor.size = real();
  anchor.keyframe = KeyframeId(id());
  for (double& x : anchor.cam_from_anchor.rotation.coeffs()) x = real();  // x y z w
  anchor.cam_from_anchor.translation = vector();
  anchor.object = ObjectId(id());
  anchor.offset = vector();
  return anchor;
}

void WriteAnchor(PgConnection& connection, const std::string& map, int64_t version,
                 const std::string& name, const std::optional<Anchor>& anchor) {
  connection.Run("DELETE FROM oaslam_anchors WHERE map = $1 AND name = $2", {map, name});
  const Anchor a = anchor.value_or(Anchor());
  const Eigen::Vector4d q = a.cam_from_anchor.rotation.coeffs();
  const Eigen::Vector3d& t = a.cam_from_anchor.translation;
  const auto id = [](auto i) { return i.IsValid() ? int64_t{i.value} : int64_t{-1}; };
  connection.Run(
      "INSERT INTO oaslam_anchors VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, "
      "$14, $15, $16, $17, $18)",
      {map, version, name, anchor ? "f" : "t", a.model, a.size, id(a.keyframe), q[0], q[1], q[2],
       q[3], t[0], t[1], t[2], id(a.object), a.offset[0], a.offset[1], a.offset[2]});
}

class MapDatabase : public MapStore {
 public:
  explicit MapDatabase(const PgLocation& location)
      : location_(location),
        own_(TemporaryFolder()),
        calls_(location, 4, std::chrono::seconds(5)),
        transfers_(location, 2, std::chrono::seconds(60)) {
    calls_.Use(CreateTables);
  }

  std::vector<StoredMap> Maps() override {
    const PgRows rows = calls_.Use(
        [](PgConnection& c) { return c.Run(SelectMaps("ORDER BY name COLLATE \"C\"")); });
    std::vector<StoredMap> maps;
    for (int row = 0; row < rows.size(); ++row) maps.push_back(MapOf(rows, row));
    return maps;
  }

  std::optional<StoredMap> Find(const std::string& map) override {
    CheckMapName(map);
    const PgRows rows =
        calls_.Use([&](PgConnection& c) { return c.Run(SelectMaps("WHERE name = $1"), {map}); });
    return rows.size() > 0 ? std::optional(MapOf(rows, 0)) : std::nullopt;
  }

  std::optional<MapFile> Open(const std::string& map) override {
    CheckMapName(map);
    return transfers_.Use([&](PgConnection& connection) -> std::optional<MapFile> {
      // A snapshot: the map that it sees stays complete in it, also when it is replaced.
      PgTransaction transaction(connection, "ISOLATION LEVEL REPEATABLE READ READ ONLY");
      const PgRows rows = connection.Run(SelectMaps("WHERE name = $1"), {map});
      if (rows.size() == 0) return std::nullopt;
      MapFile file{MapOf(rows, 0), own_->NewPath(), {}};
      file.hold = HoldFile(own_, file.path);
      Receive(connection, rows.Integer(0, 4), file);
      return file;
    });
  }

  StoredMap Put(const std::string& map, const fs::path& file) override {
    CheckMapName(map);
    return transfers_.Use([&](PgConnection& connection) {
      PgTransaction transaction(connection);
      const int64_t content = connection.Run("SELECT nextval('oaslam_contents')").Integer(0, 0);
      StoredMap stored{map, "", 0, 0};
      Send(connection, file, content, stored);
      // A millisecond is what clients can tell; the clock is the server's, one for all.
      stored.changed = connection
                           .Run(
                               "INSERT INTO oaslam_maps VALUES ($1, $2, $3, round(extract(epoch "
                               "FROM clock_timestamp()), 3), $4) ON CONFLICT (name) DO UPDATE SET "
                               "digest = excluded.digest, bytes = excluded.bytes, changed = "
                               "excluded.changed, content = excluded.content RETURNING changed",
                               {map, stored.digest, static_cast<int64_t>(stored.bytes), content})
                           .Real(0, 0);
      const PgRows replaced = connection.Run(
          "DELETE FROM oaslam_chunks WHERE map = $1 AND content <> $2 RETURNING 1", {map, content});
      if (replaced.size() > 0)
        WriteAnchor(connection, map, NextVersion(connection, map), "", std::nullopt);
      else
        connection.Run("SELECT pg_notify($1, $2)", {kChangesChannel, map});
      transaction.Commit();
      return stored;
    });
  }

  bool Remove(const std::string& map) override {
    CheckMapName(map);
    return calls_.Use([&](PgConnection& connection) {
      PgTransaction transaction(connection);
      if (connection.Run("DELETE FROM oaslam_maps WHERE name = $1 RETURNING 1", {map}).size() == 0)
        return false;
      const int64_t version = NextVersion(connection, map);
      for (const char* table : {"oaslam_chunks", "oaslam_anchors"})
        connection.Run(fmt::format("DELETE FROM {} WHERE map = $1", table), {map});
      WriteAnchor(connection, map, version, "", std::nullopt);
      transaction.Commit();
      return true;
    });
  }

  AnchorEdits AnchorsSince(const std::string& map, int64_t version) override {
    CheckMapName(map);
    return calls_.Use([&](PgConnection& connection) {
      PgTransaction transaction(connection, "ISOLATION LEVEL REPEATABLE READ READ ONLY");
      AnchorEdits edits;
      const PgRows newest =
          connection.Run("SELECT version FROM oaslam_versions WHERE map = $1", {map});
      if (newest.size() > 0) edits.version = newest.Integer(0, 0);
      const PgRows rows = connection.Run(
          "SELECT version, name, is_removed, model, size, keyframe, cam_from_anchor_qx, "
          "cam_from_anchor_qy, cam_from_anchor_qz, cam_from_anchor_qw, cam_from_anchor_tx, "
          "cam_from_anchor_ty, cam_from_anchor_tz, object, offset_x, offset_y, offset_z FROM "
          "oaslam_anchors WHERE map = $1 AND version > $2 ORDER BY version",
          {map, version});
      for (int row = 0; row < rows.size(); ++row) {
        const int64_t edited = rows.Integer(row, 0);
        const std::string name(rows.Text(row, 1));
        if (name.empty()) {
          edits.map_version = edited;
          continue;
        }
        AnchorEntry& entry = edits.entries.emplace_back(AnchorEntry{name, edited, {}});
        if (rows.Text(row, 2) == "f") entry.anchor = AnchorOf(rows, row, 3);
      }
      return edits;
    });
  }

  std::optional<int64_t> EditAnchor(const std::string& map, const std::string& name,
                                    const std::optional<Anchor>& anchor, bool must_be_new,
                                    const std::string& replaces) override {
    CheckMapName(map);
    CheckAnchorEdit(name, anchor);
    return calls_.Use([&](PgConnection& connection) -> std::optional<int64_t> {
      PgTransaction transaction(connection);
      const int64_t version = NextVersion(connection, map);
      if (must_be_new && connection
                                 .Run("SELECT 1 FROM oaslam_anchors WHERE map = $1 AND name = $2 "
                                      "AND NOT is_removed",
                                      {map, name})
                                 .size() > 0)
        return std::nullopt;
      WriteAnchor(connection, map, version, name, anchor);
      if (!replaces.empty()) WriteAnchor(connection, map, version, replaces, std::nullopt);
      transaction.Commit();
      return version;
    });
  }

  void Watch(std::function<void(const std::string& map)> changed) override {
    OASLAM_CHECK(!watch_);
    watch_ = std::make_unique<DatabaseWatch>(location_, std::move(changed));
  }

  void EndWatch() override { watch_.reset(); }

 private:
  static void Receive(PgConnection& connection, int64_t content, const MapFile& file) {
    std::ofstream out(file.path, std::ios::binary);
    Sha256 digest;
    uint64_t bytes = 0;
    for (int64_t number = 0; bytes < file.map.bytes; ++number) {
      const PgRows rows =
          connection.Run("SELECT data FROM oaslam_chunks WHERE content = $1 AND number = $2",
                         {content, number}, true);
      if (rows.size() == 0 || rows.Bytes(0, 0).empty()) break;
      const std::span<const std::byte> data = rows.Bytes(0, 0);
      digest.Add(data);
      bytes += data.size();
      out.write(reinterpret_cast<const char*>(data.data()),
                static_cast<std::streamsize>(data.size()));
    }
    out.close();
    if (!out) throw StoreUnavailable(file.path.string() + ": cannot be written");
    if (digest.Hex() != file.map.digest)
      throw InputError("database: the content of map \"" + file.map.name + "\" is damaged");
  }

  // Fills in digest and size.
  static void Send(PgConnection& connection, const fs::path& file, int64_t content,
                   StoredMap& stored) {
    std::ifstream in(file, std::ios::binary);
    std::vector<char> buffer(kChunk);
    Sha256 digest;
    for (int64_t number = 0; in; ++number) {
      in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
      const auto data = std::as_bytes(std::span(buffer.data(), static_cast<size_t>(in.gcount())));
      if (data.empty()) break;
      digest.Add(data);
      stored.bytes += data.size();
      connection.Run("INSERT INTO oaslam_chunks VALUES ($1, $2, $3, $4)",
                     {stored.name, content, number, data});
    }
    if (!in.eof()) throw InputError(file.string() + ": cannot be read");
    stored.digest = digest.Hex();
  }

  const PgLocation location_;
  std::shared_ptr<PrivateFolder> own_;
  PgPool calls_, transfers_;  // two, so that a map in transfer does not delay an edit
  std::unique_ptr<DatabaseWatch> watch_;
};

}  // namespace

std::unique_ptr<MapStore> OpenMapDatabase(const std::string& location) {
  try {
    return std::make_unique<MapDatabase>(PgLocation(location));
  } catch (const StoreUnavailable& error) {
    throw InputError(error.what());
  }
}

}  // namespace oaslam
