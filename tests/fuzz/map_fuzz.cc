#include <fuzzer/FuzzedDataProvider.h>
#include <sqlite3.h>

#include <cstdlib>
#include <memory>
#include <vector>

#include "fuzz.h"
#include "oaslam/storage/map_edit.h"
#include "random_map.h"

// Bytes of a SQLite file hardly ever change into another file that SQLite accepts. So, unless the
// first byte is odd, the bytes are edits of a valid map by SQL: which table, row and column, and
// the new value. Checksums are not compared in this build (storage/map_file_load.cc), so that the
// edits reach what reads the values.
namespace oaslam {
namespace {

struct Column {
  std::string table, name;
};

class EditedMap {
 public:
  EditedMap() : path_(folder_ / "edited.map") {
    Rng rng(7);
    SaveMap(
        folder_ / "seed.map",
        RandomMap({.keyframes = 3, .keypoints = 8, .landmarks = 6, .views = 2, .objects = 2}, rng));
    seed_ = folder_.Read("seed.map");
    Open();
    for (const std::string& table :
         Strings("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name"))
      for (const std::string& column :
           Strings("SELECT name FROM pragma_table_info('" + table + "')"))
        columns_.push_back({table, column});
  }

  const std::string& path() const { return path_; }

  void Edit(FuzzedDataProvider& edits) {
    Open();
    Execute("PRAGMA synchronous = OFF; PRAGMA journal_mode = OFF; PRAGMA foreign_keys = OFF");
    for (int i = 0; i < 8 && edits.remaining_bytes() > 0; ++i) EditOne(edits);
    database_.reset();
  }

 private:
  struct Closer {
    void operator()(sqlite3* handle) const { sqlite3_close(handle); }
  };

  void Open() {
    database_.reset();
    folder_.Write("edited.map", seed_);
    sqlite3* handle = nullptr;
    if (sqlite3_open(path_.c_str(), &handle) != SQLITE_OK) __builtin_trap();
    database_.reset(handle);
  }
  void Execute(const std::string& sql) {
    sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  }
  std::vector<std::string> Strings(const std::string& sql) {
    std::vector<std::string> result;
    const auto add = [](void* to, int, char** values, char**) {
      static_cast<std::vector<std::string>*>(to)->emplace_back(values[0]);
      return 0;
    };
    sqlite3_exec(database_.get(), sql.c_str(), add, &result, nullptr);
    return result;
  }

  void EditOne(FuzzedDataProvider& edits) {
    const Column& column = columns_[edits.ConsumeIntegralInRange<size_t>(0, columns_.size() - 1)];
    const int row = edits.ConsumeIntegralInRange(0, 15);
    const int kind = edits.ConsumeIntegralInRange(0, 6);
    const std::string place = " FROM " + column.table + " LIMIT 1 OFFSET " + std::to_string(row);
    const std::vector<std::string> keys = Strings("SELECT name FROM pragma_table_info('" +
                                                  column.table + "') WHERE pk > 0 ORDER BY pk");
    if (keys.empty()) return;
    std::string list;
    for (const std::string& key : keys) list += (list.empty() ? "" : ", ") + key;
    const std::string where = " WHERE (" + list + ") IN (SELECT " + list + place + ")";
    if (kind == 0) return Execute("DELETE FROM " + column.table + where);
    sqlite3_stmt* statement = nullptr;
    const std::string sql = "UPDATE OR IGNORE " + column.table + " SET " + column.name +
                            (kind == 1 ? " = substr(" + column.name + ", 1, ?1)" : " = ?1") + where;
    if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK)
      return;
    std::string bytes;
    switch (kind) {
      case 1:
      case 2:
        sqlite3_bind_int64(statement, 1, edits.ConsumeIntegralInRange(-2, 70000));
        break;
      case 3:
        sqlite3_bind_int64(statement, 1, edits.ConsumeIntegral<int64_t>());
        break;
      case 4:
        sqlite3_bind_double(statement, 1, edits.ConsumeFloatingPoint<double>());
        break;
      case 5:
        bytes = edits.ConsumeRandomLengthString(512);
        sqlite3_bind_blob(statement, 1, bytes.data(), static_cast<int>(bytes.size()), nullptr);
        break;
      default:
        bytes = edits.ConsumeRandomLengthString(64);
        sqlite3_bind_text(statement, 1, bytes.data(), static_cast<int>(bytes.size()), nullptr);
    }
    sqlite3_step(statement);
    sqlite3_finalize(statement);
  }

  const TempFolder folder_;
  const std::string path_;
  std::string seed_;
  std::vector<Column> columns_;
  std::unique_ptr<sqlite3, Closer> database_;
};

}  // namespace
}  // namespace oaslam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  if (size == 0) return -1;
  std::string path;
  if (data[0] % 2 == 1) {
    path = fuzz::FileOf(fuzz::Text(data + 1, size - 1), "raw.map");
  } else {
    static EditedMap& map = *new EditedMap();
    FuzzedDataProvider edits(data + 1, size - 1);
    map.Edit(edits);
    path = map.path();
  }
  return fuzz::Try([&] {
    const bool has_state = StateOfMap(path).has_value();
    // What has been read can be written and read again.
    const SavedMap saved = LoadMap(path);
    if (!has_state) std::abort();
    const std::string again = path + ".again";
    SaveMap(again, saved);
    EditMap(again, [](SavedMap& map) { map.map.anchors.clear(); });
  });
}
