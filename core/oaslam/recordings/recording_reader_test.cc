#include "oaslam/recordings/recording_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "oaslam/error.h"
#include "oaslam/recordings/decompression.h"
#include "recording_writer.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr size_t kBehindHeader = 8 + 9 + 12;  // of an MCAP file

// Messages of two topics, some longer than what is read ahead.
std::vector<WrittenMessage> SomeMessages(int count = 7) {
  std::vector<WrittenMessage> messages;
  for (int i = 0; i < count; ++i) {
    const std::string data = std::string("\0\1\0\0", 4) +
                             std::string(i % 2 == 0 ? 30000 : 9, static_cast<char>('a' + i));
    messages.push_back({i % 2 == 0 ? "/camera/image" : "/imu",
                        i % 2 == 0 ? "sensor_msgs/Image" : "sensor_msgs/Imu",
                        1'700'000'000'000'000'000 + i, data});
  }
  return messages;
}

struct Read {
  std::vector<WrittenMessage> messages;
  std::string problem;
};

Read ReadAll(const std::string& path, size_t wanted = kWholeMessage) {
  Read read;
  const auto reader = OpenRecording(path, [&](const RecordedTopic&) { return wanted; });
  while (const auto message = reader->Next())
    read.messages.push_back({message->topic->name,
                             message->topic->type,
                             message->log_time,
                             {message->data.begin(), message->data.end()}});
  read.problem = reader->problem();
  return read;
}

std::string RefusalOf(const std::string& path) {
  try {
    ReadAll(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

uint32_t CrcOf(const std::string& text) {
  return Crc32({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

// The records of the only chunk in an MCAP file of these messages.
std::string ChunkOf(const std::vector<WrittenMessage>& messages) {
  const std::string file = Mcap(messages, 0);
  const size_t begin = kBehindHeader, end = file.size() - 8 - (9 + 20) - (9 + 4);
  return file.substr(begin, end - begin);
}

std::vector<std::string> NamesIn(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::ranges::sort(names);
  return names;
}

TEST(RecordingReader, ReadsEveryContainerAlike) {
  const TempFolder folder;
  const auto messages = SomeMessages();
  std::vector<std::string> paths = {
      folder.Write("flat.mcap", Mcap(messages, 0)),
      folder.Write("plain.mcap", Mcap(messages, 3)),
      folder.Write("checked.mcap", Mcap(messages, 7, "", CrcOf(ChunkOf(messages)))),
      folder.Write("zstd.mcap", Mcap(messages, 3, "zstd")),
      folder.Write("lz4.mcap", Mcap(messages, 3, "lz4")),
      folder.Write("whole.mcap.zstd", Packed("zstd", Mcap(messages, 3))),
      folder.Write("whole.bag.zst", Packed("zstd", RosBag(messages, 3))),
      folder.Write("plain.bag", RosBag(messages, 3)),
      folder.Write("bz2.bag", RosBag(messages, 3, "bz2")),
      folder.Write("lz4.bag", RosBag(messages, 3, "lz4")),
      folder / "a.db3",
      folder / "packed.db3"};
  RosbagDatabase(folder / "a.db3", messages);
  RosbagDatabase(folder / "packed.db3", messages, true);
  paths.push_back(folder.Write("whole.db3.zstd", Packed("zstd", folder.Read("a.db3"))));
  const std::vector<WrittenMessage> first(messages.begin(), messages.begin() + 4);
  folder.Write("split/z_0.mcap", Mcap(first, 2));
  folder.Write("split/metadata.yaml",
               "rosbag2_bagfile_information:\n  relative_file_paths:\n    - z_0.mcap\n    - "
               "split/a_1.mcap\n");
  folder.Write("split/a_1.mcap", Mcap({messages.begin() + 4, messages.end()}, 2));
  paths.push_back(folder / "split");
  folder.Write("killed/b_2.mcap", Mcap(first, 2));
  folder.Write("killed/b_10.mcap", Mcap({messages.begin() + 4, messages.end()}, 2));
  paths.push_back(folder / "killed");
  for (const std::string& path : paths) {
    EXPECT_TRUE(IsRecording(path)) << path;
    const Read read = ReadAll(path);
    EXPECT_TRUE(read.messages == messages) << path;
    EXPECT_EQ(read.problem, "") << path;
    const Read heads = ReadAll(path, 5);
    ASSERT_EQ(heads.messages.size(), messages.size()) << path;
    EXPECT_EQ(heads.messages[2].data, messages[2].data.substr(0, 5)) << path;
  }
}

TEST(RecordingReader, UsesWhatComesBeforeACut) {
  const TempFolder folder;
  std::vector<WrittenMessage> messages = SomeMessages();
  for (WrittenMessage& message : messages) message.data.resize(9);
  for (const std::string& whole : {Mcap(messages, 0), Mcap(messages, 3), Mcap(messages, 3, "zstd"),
                                   Mcap(messages, 7, "", CrcOf(ChunkOf(messages))),
                                   RosBag(messages, 3), RosBag(messages, 3, "bz2")}) {
    const bool is_mcap = whole[1] == 'M';
    size_t most = 0;
    for (size_t size = 20; size < whole.size(); size += 3) {
      const Read read = ReadAll(folder.Write("cut", whole.substr(0, size)));
      ASSERT_LE(read.messages.size(), messages.size());
      ASSERT_GE(read.messages.size(), most) << size;
      most = read.messages.size();
      EXPECT_TRUE(std::ranges::equal(read.messages, std::span(messages).first(most))) << size;
      if (is_mcap && most < messages.size()) {
        EXPECT_THAT(read.problem, AllOf(HasSubstr("cut"), HasSubstr("ends early"))) << size;
      }
    }
    EXPECT_GE(most + 1, messages.size());  // the last is not whole
  }
}

TEST(RecordingReader, RefusesLengthsThatCannotBe) {
  const TempFolder folder;
  const auto messages = SomeMessages();
  for (std::string file : {Mcap(messages, 0), Mcap(messages, 3)}) {
    file.replace(kBehindHeader + 1, 8, Bytes(uint64_t{1} << 63));
    EXPECT_THAT(RefusalOf(folder.Write("a.mcap", file)),
                AllOf(HasSubstr("a.mcap: at byte "), HasSubstr("9223372036854775808")));
  }
  std::string bag = RosBag(messages, 3);
  const size_t message = bag.find("op=\x02") - 8;
  bag.replace(message, 4, Bytes(uint32_t{0xfffffff0}));
  EXPECT_THAT(RefusalOf(folder.Write("a.bag", bag)), HasSubstr("a.bag: at byte "));
  // A chunk that claims a gigabyte more than it has.
  std::string chunk = Mcap(messages, 7, "zstd");
  chunk.replace(kBehindHeader + 9 + 16, 8, Bytes(uint64_t{1} << 29));
  EXPECT_THAT(RefusalOf(folder.Write("b.mcap", chunk)), HasSubstr("expected 536870912 bytes"));
}

TEST(RecordingReader, RefusesWhatIsDamaged) {
  const TempFolder folder;
  const auto messages = SomeMessages();
  EXPECT_THAT(RefusalOf(folder.Write("a.mcap", Mcap(messages, 7, "", 12345))),
              AllOf(HasSubstr("a.mcap: at byte 38"), HasSubstr("checksum")));
  std::string packed = Mcap(messages, 7, "lz4");
  packed[packed.size() / 2] = static_cast<char>(packed[packed.size() / 2] ^ 0x55);
  EXPECT_THAT(RefusalOf(folder.Write("b.mcap", packed)), HasSubstr("b.mcap: at byte "));
  EXPECT_THAT(RefusalOf(folder.Write("c.mcap", Mcap(messages, 7, "snappy"))),
              HasSubstr("compressed by \"snappy\", allowed: zstd, lz4, bz2"));
  folder.Write("d/metadata.yaml",
               "rosbag2_bagfile_information: {relative_file_paths: [d_0.db3]}\n");
  EXPECT_THAT(RefusalOf(folder / "d"), HasSubstr("d_0.db3 is not there"));
  EXPECT_THAT(RefusalOf(folder.Write("e.db3", "SQLite format 3" + std::string(4000, '\0'))),
              HasSubstr("e.db3: is no recording of rosbag2"));
}

// As a recorder leaves them that was killed: what is in the log is read, and nothing is written.
TEST(RecordingReader, LeavesNoFileBesideADatabase) {
  const TempFolder folder;
  const auto messages = SomeMessages();
  {
    const SQLite::Database open = RosbagDatabase(folder / "a.db3", messages, false, true);
    fs::create_directory(folder / "killed");
    for (const char* name : {"a.db3", "a.db3-wal"})
      fs::copy_file(folder / name, fs::path(folder / "killed") / name);
  }
  const std::string before = folder.Read("killed/a.db3-wal");
  EXPECT_GT(before.size(), 100000U);
  EXPECT_TRUE(ReadAll(folder / "killed").messages == messages);
  EXPECT_EQ(NamesIn(folder / "killed"), (std::vector<std::string>{"a.db3", "a.db3-wal"}));
  EXPECT_EQ(folder.Read("killed/a.db3-wal"), before);
  // A database that was closed keeps the mode of the log, but has none.
  fs::create_directory(folder / "closed");
  fs::copy_file(folder / "a.db3", folder / "closed/a.db3");
  EXPECT_TRUE(ReadAll(folder / "closed").messages == messages);
  EXPECT_EQ(NamesIn(folder / "closed"), std::vector<std::string>{"a.db3"});
  const std::string packed = Packed("zstd", folder.Read("a.db3"));
  EXPECT_TRUE(ReadAll(folder.Write("closed/b.db3.zstd", packed)).messages == messages);
}

// A file in which a few bytes stand for messages without end.
TEST(RecordingReader, RefusesADatabaseThatIsNoStore) {
  const TempFolder folder;
  const std::string numbers = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)";
  const std::string topic = "'/a', 'a/msg/B', 'cdr'";
  const std::string topics =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
      "INSERT INTO topics VALUES(1, " +
      topic + ");";
  const std::string view =
      " AS " + numbers + " SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n;";
  const std::pair<std::string, std::string> schemas[] = {
      {topics + "CREATE VIEW messages" + view, "it has no table \"messages\""},
      {"CREATE VIEW topics(id, name, type, serialization_format) AS " + numbers + " SELECT i, " +
           topic +
           " FROM n; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)",
       "it has no table \"topics\""},
      {topics + "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS "
                "(zeroblob(id * 1000000000)))",
       "its column messages.data is computed"},
      {topics + "CREATE VIEW endless" + view +
           "CREATE VIRTUAL TABLE messages USING fts5(id, topic_id, timestamp, data, "
           "content = 'endless', content_rowid = 'id')",
       "no such module"}};
  for (const auto& [schema, problem] : schemas) {
    const std::string path = folder.Write("a.db3", "");
    SQLite::Database(path, SQLite::OPEN_READWRITE).exec(schema);
    EXPECT_THAT(RefusalOf(path), HasSubstr("a.db3: is no recording of rosbag2: " + problem));
    // Of one that is cut SQLite checks less.
    std::string cut = folder.Read("a.db3");
    cut[31] = static_cast<char>(cut[31] + 1);  // how many pages there are
    EXPECT_THAT(RefusalOf(folder.Write("cut.db3", cut)), HasSubstr(problem));
  }
}

TEST(RecordingReader, RefusesADatabaseWhosePagesAreInACircle) {
  const TempFolder folder;
  std::vector<WrittenMessage> messages(2000, SomeMessages(1)[0]);
  for (WrittenMessage& message : messages) message.data.resize(9);
  const auto page = static_cast<size_t>([&] {
    const SQLite::Database database = RosbagDatabase(folder / "a.db3", messages);
    SQLite::Database& open = const_cast<SQLite::Database&>(database);
    return open.execAndGet("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").getInt();
  }());
  std::string file = folder.Read("a.db3");
  // The root refers to the other pages: to the last one in its head, to the others in cells.
  constexpr size_t kPageSize = 4096, kLast = 8, kCells = 12;
  const size_t root = (page - 1) * kPageSize;
  ASSERT_EQ(file[root], 5);
  const auto cell = static_cast<size_t>(256 * static_cast<uint8_t>(file[root + kCells]) +
                                        static_cast<uint8_t>(file[root + kCells + 1]));
  file.replace(root + kLast, 4, file.substr(root + cell, 4));
  EXPECT_THAT(RefusalOf(folder.Write("b.db3", file)),
              AllOf(HasSubstr("b.db3: is damaged: message 1 comes behind ")));
}

class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& path) { setenv("TMPDIR", path.c_str(), 1); }
  ~TemporaryFolder() {
    if (before_.empty())
      unsetenv("TMPDIR");
    else
      setenv("TMPDIR", before_.c_str(), 1);
  }

 private:
  const std::string before_ = getenv("TMPDIR") ? getenv("TMPDIR") : "";
};

TEST(RecordingReader, DecompressesAFileOnce) {
  const TempFolder folder;
  fs::create_directory(folder / "tmp");
  const TemporaryFolder temporary(folder / "tmp");
  const auto messages = SomeMessages();
  RosbagDatabase(folder / "a.db3", messages);
  for (const std::string& plain : {Mcap(messages, 3), folder.Read("a.db3")}) {
    const std::string name = plain[1] == 'M' ? "a.mcap.zstd" : "a.db3.zstd";
    const std::string path = folder.Write(name, Packed("zstd", plain));
    EXPECT_TRUE(ReadAll(path).messages == messages);
    EXPECT_TRUE(NamesIn(folder / "tmp").empty());
    // What cannot be decompressed would be refused.
    const auto time = fs::last_write_time(path);
    folder.Write(name, std::string(fs::file_size(path), 'x'));
    fs::last_write_time(path, time);
    EXPECT_TRUE(ReadAll(path).messages == messages);
    fs::last_write_time(path, time + std::chrono::seconds(1));
    EXPECT_THAT(RefusalOf(path), HasSubstr("its compressed content is damaged"));
  }
  const TemporaryFolder none(folder / "none");
  EXPECT_THAT(RefusalOf(folder.Write("b.mcap.zstd", Packed("zstd", Mcap(messages, 3)))),
              HasSubstr("the folder for temporary files"));
}

TEST(RecordingReader, UsesWhatComesBeforeTheCutOfADatabase) {
  const TempFolder folder;
  const auto messages = SomeMessages(60);
  RosbagDatabase(folder / "a.db3", messages);
  const std::string whole = folder.Read("a.db3");
  const Read read = ReadAll(folder.Write("cut.db3", whole.substr(0, whole.size() * 2 / 3)));
  EXPECT_GE(read.messages.size(), 20U);
  ASSERT_LT(read.messages.size(), messages.size());
  EXPECT_TRUE(std::ranges::equal(read.messages, std::span(messages).first(read.messages.size())));
  EXPECT_THAT(read.problem, HasSubstr("cut.db3: ends early"));
}

TEST(RecordingReader, TellsRecordingsFromOtherFiles) {
  const TempFolder folder;
  EXPECT_FALSE(IsRecording(folder.path()));
  EXPECT_FALSE(IsRecording(folder / "none.bag"));
  EXPECT_FALSE(IsRecording(folder.Write("old.bag", "#ROSBAG V1.2\n")));
  EXPECT_FALSE(IsRecording(folder.Write("images/metadata.yaml", "date: today\n")));
  EXPECT_FALSE(IsRecording(folder / "images"));
  folder.Write("mixed/a.mcap", Mcap({}, 0));
  EXPECT_TRUE(IsRecording(folder / "mixed"));
  folder.Write("mixed/mav0/cam0/data.csv", "");  // a dataset with its recording beside it
  EXPECT_FALSE(IsRecording(folder / "mixed"));
  EXPECT_TRUE(IsRecording(folder.Write("x.dat", Mcap({}, 0))));
  // Results of a run beside the file of a rosbag2.
  folder.Write("killed/a.mcap", Mcap(SomeMessages(), 0));
  folder.Write("killed/a.oaslam/frames.csv", "");
  EXPECT_TRUE(IsRecording(folder / "killed"));
  EXPECT_FALSE(IsRecording(folder / "killed/metadata.yaml"));
  const std::string metadata = folder.Write(
      "killed/metadata.yaml", "rosbag2_bagfile_information: {relative_file_paths: [a.mcap]}\n");
  EXPECT_TRUE(IsRecording(metadata));
  EXPECT_TRUE(ReadAll(metadata).messages == SomeMessages());
}

TEST(Crc32, IsThatOfZip) { EXPECT_EQ(CrcOf("123456789"), 0xcbf43926); }

}  // namespace
}  // namespace oaslam
