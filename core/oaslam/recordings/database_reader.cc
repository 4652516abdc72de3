#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <array>
#include <filesystem>
#include <map>
#include <utility>

#include "oaslam/recordings/containers.h"
#include "oaslam/recordings/decompression.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// Opens a database so that SQLite makes no file beside it: without locks, which also reads a
// write-ahead log where there is one, with its index in memory.
SQLite::Database OpenUnlocked(const std::string& path) {
  std::error_code error;
  const bool has_log = fs::exists(path + "-wal", error);
  std::string uri = "file:";
  for (const fs::path& part : fs::absolute(path).relative_path())
    uri += '/' + EncodeUriSegment(part.string());
  SQLite::Database database(uri + (has_log ? "" : "?immutable=1"),
                            SQLite::OPEN_READONLY | SQLITE_OPEN_URI, 0, has_log ? "unix-none" : "");
  sqlite3_db_config(database.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  // The file is not trusted.
  sqlite3_db_config(database.getHandle(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(database.getHandle(), SQLITE_LIMIT_LENGTH, static_cast<int>(kLongestRecord));
  if (has_log) database.exec("PRAGMA locking_mode = EXCLUSIVE");
  return database;
}

// Whether a database has fewer pages than it says, as a copy that was not finished.
bool IsCutDatabase(const RecordingFile& given) {
  RecordBytes file(given.path, given.name);
  constexpr uint64_t kHeader = 100, kPageSize = 16, kPages = 28;
  if (file.size() < kHeader) return true;
  const ByteView head = file.Take(kHeader);
  const auto big_endian = [&](uint64_t from, int bytes) {
    uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value = 256 * value + head[from + static_cast<uint64_t>(i)];
    return value;
  };
  const uint64_t size = big_endian(kPageSize, 2);
  return file.size() < (size == 1 ? 65536 : size) * big_endian(kPages, 4);
}

struct DatabaseTopic {
  RecordedTopic topic;
  size_t wanted = 0;  // bytes
};

// Reads rosbag2's storage of all generations.
class DatabaseReader : public RecordingReader {
 public:
  DatabaseReader(const RecordingFile& file, const BytesWanted& wanted)
      : name_(file.name), is_cut_(IsCutDatabase(file)), database_(OpenUnlocked(file.path)) {
    // Of a database that is cut SQLite reads the pages that are there only then.
    if (is_cut_) database_.exec("PRAGMA writable_schema = ON");
    std::string of_wanted;
    SQLite::Statement topics(database_, "SELECT id, name, type, serialization_format FROM topics");
    while (topics.executeStep()) {
      DatabaseTopic topic;
      topic.topic = {topics.getColumn(1).getString(), PlainType(topics.getColumn(2).getString()),
                     MessageEncoding::kOther, topics.getColumn(3).getString()};
      if (topic.topic.encoding_name == "cdr") topic.topic.encoding = MessageEncoding::kCdr;
      topic.wanted = wanted(topic.topic);
      const int64_t id = topics.getColumn(0).getInt64();
      if (topic.wanted > 0) of_wanted += fmt::format("{}{}", of_wanted.empty() ? "" : ",", id);
      topics_.try_emplace(id, std::move(topic));
    }
    // In the order in which they were written: an index would visit a large file back and forth.
    messages_.emplace(database_,
                      fmt::format("SELECT topic_id, timestamp, id, CASE WHEN topic_id IN ({}) THEN "
                                  "data END FROM messages ORDER BY id",
                                  of_wanted));
  }

  std::optional<RecordedMessage> Next() override {
    while (Step()) {
      const auto topic = topics_.find(messages_->getColumn(0).getInt64());
      if (topic == topics_.end()) continue;
      const int64_t log_time = messages_->getColumn(1).getInt64();
      id_ = messages_->getColumn(2).getInt64();
      const SQLite::Column column = messages_->getColumn(3);
      ByteView data(static_cast<const uint8_t*>(column.getBlob()),
                    static_cast<size_t>(column.getBytes()));
      // Compressed by message. A CDR begins with 0.
      constexpr std::array<uint8_t, 4> kZstdMagic = {0x28, 0xb5, 0x2f, 0xfd};
      if (data.size() > kZstdMagic.size() &&
          std::ranges::equal(data.first(kZstdMagic.size()), kZstdMagic)) {
        plain_ = DecompressFrame(data, Place());
        data = plain_.view();
      }
      const DatabaseTopic& known = topic->second;
      return RecordedMessage{&known.topic, log_time,
                             data.first(std::min(known.wanted, data.size()))};
    }
    return std::nullopt;
  }

  std::string Place() const override { return fmt::format("{}: message {}", name_, id_); }

 private:
  // Whether there is another message.
  bool Step() {
    try {
      if (messages_->executeStep()) return true;
    } catch (const SQLite::Exception& error) {
      if (!is_cut_) throw BadInput("{}: behind message {}: {}", name_, id_, error.what());
    }
    if (is_cut_)
      problem_ =
          fmt::format("{}: ends early, behind message {}: what comes before is used", name_, id_);
    return false;
  }

  std::string name_;
  bool is_cut_;
  SQLite::Database database_;
  std::map<int64_t, DatabaseTopic> topics_;
  std::optional<SQLite::Statement> messages_;
  int64_t id_ = 0;  // of the last message
  PlainBytes plain_;
};

}  // namespace

std::unique_ptr<RecordingReader> OpenRosbagDatabase(const RecordingFile& file, BytesWanted wanted) {
  try {
    return std::make_unique<DatabaseReader>(file, wanted);
  } catch (const SQLite::Exception& error) {
    throw BadInput("{}: is no recording of rosbag2: {}", file.name, error.what());
  }
}

}  // namespace oaslam
