#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

namespace oaslam {

// Writes recordings of ROS for tests, byte by byte as their specifications have them.

template <typename T>
std::string Bytes(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}
inline std::string WithLength(const std::string& text) {
  return Bytes(static_cast<uint32_t>(text.size())) + text;
}

// A message that is written value by value: CDR in either order of bytes, or ROS 1.
class MessageWriter {
 public:
  enum Kind { kCdr, kBigEndianCdr, kRos1 };
  explicit MessageWriter(Kind kind) : kind_(kind) {}

  template <typename T>
  MessageWriter& Put(T value) {
    if (kind_ != kRos1) body_.resize((body_.size() + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    std::string bytes = Bytes(value);
    body_ += kind_ == kBigEndianCdr ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
    return *this;
  }
  MessageWriter& Doubles(std::initializer_list<double> values) {
    for (const double value : values) Put(value);
    return *this;
  }
  MessageWriter& Zeros(int count) {
    for (int i = 0; i < count; ++i) Put(0.0);
    return *this;
  }
  MessageWriter& Sequence(const std::string& bytes) {
    Put(static_cast<uint32_t>(bytes.size()));
    body_ += bytes;
    return *this;
  }
  MessageWriter& Text(const std::string& text) {
    return Sequence(kind_ == kRos1 ? text : text + '\0');
  }
  MessageWriter& Header(int64_t stamp, const std::string& frame) {
    if (kind_ == kRos1) Put(uint32_t{7});
    Put(static_cast<uint32_t>(stamp / 1'000'000'000));
    return Put(static_cast<uint32_t>(stamp % 1'000'000'000)).Text(frame);
  }
  std::string Finish() const {
    const std::string head = kind_ == kRos1 ? "" : std::string{0, kind_ == kCdr, 0, 0};
    return head + body_;
  }

 private:
  Kind kind_;
  std::string body_;
};

struct WrittenMessage {
  std::string topic, type;  // "sensor_msgs/Image"
  int64_t log_time = 0;
  std::string data;

  bool operator==(const WrittenMessage&) const = default;
};

inline std::string Packed(const std::string& how, const std::string& plain) {
  std::string packed(plain.size() * 2 + 1000, '\0');
  size_t size = 0;
  if (how == "zstd") {
    size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 1);
  } else if (how == "lz4") {
    size = LZ4F_compressFrame(packed.data(), packed.size(), plain.data(), plain.size(), nullptr);
  } else if (how == "bz2") {
    auto length = static_cast<unsigned>(packed.size());
    BZ2_bzBuffToBuffCompress(packed.data(), &length, const_cast<char*>(plain.data()),
                             static_cast<unsigned>(plain.size()), 1, 0, 0);
    size = length;
  } else {
    return plain;
  }
  packed.resize(size);
  return packed;
}

// "sensor_msgs/msg/Image" of "sensor_msgs/Image".
inline std::string Ros2Type(std::string type) { return type.insert(type.find('/'), "/msg"); }

// An MCAP file with chunks of so many messages, 0: without chunks. `crc`: of the one chunk.
inline std::string Mcap(const std::vector<WrittenMessage>& messages, size_t chunk,
                        const std::string& how = "", uint32_t crc = 0) {
  const auto record = [](char kind, const std::string& content) {
    return kind + Bytes(uint64_t{content.size()}) + content;
  };
  std::string file = "\x89MCAP0\r\n" + record(1, WithLength("ros2") + WithLength("")), inside;
  std::map<std::string, uint16_t> channels;
  const auto flush = [&](const std::string& records) {
    const std::string packed = Packed(how, records);
    file += record(6, Bytes(uint64_t{0}) + Bytes(uint64_t{0}) + Bytes(uint64_t{records.size()}) +
                          Bytes(crc) + WithLength(how) + Bytes(uint64_t{packed.size()}) + packed);
  };
  for (size_t i = 0; i < messages.size(); ++i) {
    const WrittenMessage& m = messages[i];
    const auto [channel, is_new] =
        channels.emplace(m.topic, static_cast<uint16_t>(channels.size() + 1));
    const std::string id = Bytes(channel->second);
    if (is_new)
      inside += record(3, id + WithLength(Ros2Type(m.type)) + WithLength("ros2msg") +
                              WithLength("text")) +
                record(4, id + id + WithLength(m.topic) + WithLength("cdr") + WithLength(""));
    inside += record(5, id + Bytes(uint32_t{0}) + Bytes(m.log_time) + Bytes(m.log_time) + m.data);
    if (chunk > 0 && ((i + 1) % chunk == 0 || i + 1 == messages.size())) {
      flush(inside);
      inside.clear();
    }
  }
  return file + inside + record(15, std::string(4, '\0')) + record(2, std::string(20, '\0')) +
         "\x89MCAP0\r\n";
}

// A ROS 1 bag with chunks of so many messages.
inline std::string RosBag(const std::vector<WrittenMessage>& messages, size_t chunk,
                          const std::string& how = "none") {
  const auto field = [](const std::string& name, const std::string& value) {
    return WithLength(name + "=" + value);
  };
  const auto record = [&](char kind, const std::string& fields, const std::string& data) {
    return WithLength(field("op", std::string(1, kind)) + fields) + WithLength(data);
  };
  std::string file = "#ROSBAG V2.0\n" + record(3, field("index_pos", Bytes(uint64_t{0})), "    ");
  std::string inside;
  std::map<std::string, uint32_t> connections;
  for (size_t i = 0; i < messages.size(); ++i) {
    const WrittenMessage& m = messages[i];
    const auto [connection, is_new] =
        connections.emplace(m.topic, static_cast<uint32_t>(connections.size()));
    const std::string id = field("conn", Bytes(connection->second));
    if (is_new)
      inside +=
          record(7, id + field("topic", m.topic), field("type", m.type) + field("md5sum", ""));
    const std::string time = Bytes(static_cast<uint32_t>(m.log_time / 1'000'000'000)) +
                             Bytes(static_cast<uint32_t>(m.log_time % 1'000'000'000));
    inside += record(2, id + field("time", time), m.data);
    if ((i + 1) % chunk == 0 || i + 1 == messages.size()) {
      file += record(
          5, field("compression", how) + field("size", Bytes(static_cast<uint32_t>(inside.size()))),
          Packed(how, inside));
      inside.clear();
    }
  }
  return file;
}

// A database of rosbag2. `packs`: each message by zstd. `log`: it stays in a write-ahead log while
// the database that is returned lives.
inline SQLite::Database RosbagDatabase(const std::string& path,
                                       const std::vector<WrittenMessage>& messages,
                                       bool packs = false, bool log = false) {
  SQLite::Database database(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  if (log) database.exec("PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0");
  database.exec(
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER "
      "NOT NULL, data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
  std::map<std::string, int> topics;
  for (const WrittenMessage& m : messages) {
    const auto [topic, is_new] = topics.emplace(m.topic, static_cast<int>(topics.size() + 1));
    if (is_new) {
      SQLite::Statement add(database, "INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')");
      add.bind(1, topic->second);
      add.bind(2, m.topic);
      add.bind(3, Ros2Type(m.type));
      add.exec();
    }
    SQLite::Statement add(database,
                          "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)");
    const std::string data = packs ? Packed("zstd", m.data) : m.data;
    add.bind(1, topic->second);
    add.bind(2, static_cast<int64_t>(m.log_time));
    add.bind(3, data.data(), static_cast<int>(data.size()));
    add.exec();
  }
  return database;
}

}  // namespace oaslam
