#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <sys/mman.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <map>
#include <utility>

#include "oaslam/formats/text.h"
#include "oaslam/recordings/containers.h"
#include "oaslam/recordings/decompression.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/unique_fd.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// The bytes of a file, of which the kernel reads those that are used. Changes stay in memory.
class MappedFile {
 public:
  explicit MappedFile(const RecordingFile& file) {
    const UniqueFd fd(open(file.path.c_str(), O_RDONLY | O_CLOEXEC));
    const off_t end = lseek(fd.get(), 0, SEEK_END);
    if (end > 0) size_ = static_cast<size_t>(end);
    bytes_ = mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE, fd.get(), 0);
    if (bytes_ == MAP_FAILED)
      throw BadInput("{}: cannot be read: {}", file.name, std::generic_category().message(errno));
  }
  ~MappedFile() { munmap(bytes_, size_); }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  uint8_t* bytes() const { return static_cast<uint8_t*>(bytes_); }
  size_t size() const { return size_; }

 private:
  void* bytes_ = nullptr;
  size_t size_ = 0;
};

// Opens a database in memory.
SQLite::Database OpenInMemory(const MappedFile& file) {
  // Such a database has no write-ahead log, which its header may mention.
  constexpr size_t kModes = 18;  // of writing and reading
  file.bytes()[kModes] = file.bytes()[kModes + 1] = 1;
  SQLite::Database database(":memory:", SQLite::OPEN_READWRITE);
  const auto size = static_cast<sqlite3_int64>(file.size());
  const int result = sqlite3_deserialize(database.getHandle(), "main", file.bytes(), size, size,
                                         SQLITE_DESERIALIZE_READONLY);
  if (result != SQLITE_OK) throw SQLite::Exception(database.getHandle(), result);
  return database;
}

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
  if (has_log) database.exec("PRAGMA locking_mode = EXCLUSIVE");
  return database;
}

// The file is not trusted. `is_cut`: SQLite refuses such a file unless it is to be mended.
void Restrain(SQLite::Database& database, bool is_cut) {
  sqlite3* handle = database.getHandle();
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, static_cast<int>(kLongestRecord));
  sqlite3_drop_modules(handle, nullptr);
  if (is_cut) database.exec("PRAGMA writable_schema = ON");
}

// A view, or a column that is computed, may have more content than the file, and no end.
void CheckIsStored(SQLite::Database& database, const char* table, const std::string& name) {
  sqlite3* handle = database.getHandle();
  const int result = sqlite3_table_column_metadata(handle, "main", table, nullptr, nullptr, nullptr,
                                                   nullptr, nullptr, nullptr);
  if (result != SQLITE_OK && result != SQLITE_ERROR) throw SQLite::Exception(handle, result);
  if (result == SQLITE_ERROR)
    throw BadInput("{}: is no recording of rosbag2: it has no table \"{}\"", name, table);
  SQLite::Statement columns(database, fmt::format("PRAGMA table_xinfo({})", table));
  constexpr int kName = 1, kHidden = 6;
  while (columns.executeStep())
    if (columns.getColumn(kHidden).getInt() != 0)
      throw BadInput("{}: is no recording of rosbag2: its column {}.{} is computed", name, table,
                     OnOneLine(columns.getColumn(kName).getString(), 60));
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

// Reads rosbag2's storage of all generations.
class DatabaseReader : public RecordingReader {
 public:
  DatabaseReader(const RecordingFile& file, const BytesWanted& wanted)
      : name_(file.name),
        is_cut_(IsCutDatabase(file)),
        copy_(file.IsCopy() ? std::make_unique<MappedFile>(file) : nullptr),
        database_(copy_ ? OpenInMemory(*copy_) : OpenUnlocked(file.path)) {
    Restrain(database_, is_cut_);
    for (const char* table : {"topics", "messages"}) CheckIsStored(database_, table, name_);
    const std::string of_wanted = ReadTopics(wanted);
    // In the order in which they were written: an index would visit a large file back and forth.
    messages_.emplace(database_,
                      fmt::format("SELECT topic_id, timestamp, rowid, CASE WHEN topic_id IN ({}) "
                                  "THEN data END FROM messages NOT INDEXED ORDER BY rowid",
                                  of_wanted));
  }

  std::optional<RecordedMessage> Next() override {
    while (Step()) {
      const auto topic = topics_.find(messages_->getColumn(0).getInt64());
      if (topic == topics_.end()) continue;
      const int64_t log_time = messages_->getColumn(1).getInt64();
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
      const WantedTopic& known = topic->second;
      return RecordedMessage{&known.topic, log_time,
                             data.first(std::min(known.wanted, data.size()))};
    }
    return std::nullopt;
  }

  std::string Place() const override {
    return fmt::format("{}: message {}", name_, id_.value_or(0));
  }

 private:
  // Returns the numbers of those of which messages are wanted.
  std::string ReadTopics(const BytesWanted& wanted) {
    std::string of_wanted;
    SQLite::Statement topics(database_,
                             "SELECT id, name, type, serialization_format, rowid FROM topics NOT "
                             "INDEXED ORDER BY rowid");
    for (std::optional<int64_t> last; topics.executeStep();) {
      CheckAscends(last, topics.getColumn(4).getInt64(), "topic");
      WantedTopic topic;
      topic.topic = {topics.getColumn(1).getString(), PlainType(topics.getColumn(2).getString()),
                     MessageEncoding::kOther, topics.getColumn(3).getString()};
      if (topic.topic.encoding_name == "cdr") topic.topic.encoding = MessageEncoding::kCdr;
      topic.wanted = wanted(topic.topic);
      const int64_t id = topics.getColumn(0).getInt64();
      if (topic.wanted > 0) of_wanted += fmt::format("{}{}", of_wanted.empty() ? "" : ",", id);
      topics_.try_emplace(id, std::move(topic));
    }
    return of_wanted;
  }

  // Pages of a damaged file may refer to each other in circles.
  void CheckAscends(std::optional<int64_t>& last, int64_t row, const char* what) const {
    if (last && row <= *last)
      throw BadInput("{}: is damaged: {} {} comes behind {}", name_, what, row, *last);
    last = row;
  }

  // Whether there is another message.
  bool Step() {
    try {
      if (messages_->executeStep()) {
        CheckAscends(id_, messages_->getColumn(2).getInt64(), "message");
        return true;
      }
    } catch (const SQLite::Exception& error) {
      if (!is_cut_)
        throw BadInput("{}: behind message {}: {}", name_, id_.value_or(0), error.what());
    }
    if (is_cut_)
      problem_ = fmt::format("{}: ends early, behind message {}: what comes before is used", name_,
                             id_.value_or(0));
    return false;
  }

  std::string name_;
  bool is_cut_;
  std::unique_ptr<MappedFile> copy_;  // which the database is read from; none where it has a path
  SQLite::Database database_;
  std::map<int64_t, WantedTopic> topics_;
  std::optional<SQLite::Statement> messages_;
  std::optional<int64_t> id_;  // of the last message
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
