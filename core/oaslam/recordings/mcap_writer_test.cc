#include "oaslam/recordings/mcap_writer.h"

#include <filesystem>
#include <fstream>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/recordings/cdr_writer.h"
#include "oaslam/recordings/decompression.h"
#include "oaslam/recordings/recording_reader.h"
#include "oaslam/recordings/ros_definitions.h"

namespace oaslam {
namespace {

using McapWriting = FolderTest;
constexpr int64_t kFirstTime = 1'700'000'000'000'000'000;

// Longer than a chunk together, so that there are several; messages that cannot be compressed.
struct McapSample {
  std::string topic, type;
  int64_t time;
  ByteBuffer data;
};
std::vector<McapSample> McapSamples() {
  std::vector<McapSample> samples;
  uint32_t random = 1;
  for (int i = 0; i < 30; ++i) {
    const bool is_image = i % 3 == 0;
    ByteBuffer data{0, 1, 0, 0};
    for (int k = 0; k < (is_image ? 300'000 : 5); ++k)
      data.push_back(static_cast<uint8_t>((random = random * 1664525 + 1013904223) >> 24));
    // Times are not in order.
    samples.push_back({is_image ? "/image" : "/path",
                       is_image ? "sensor_msgs/CompressedImage" : "nav_msgs/Path",
                       kFirstTime + (i % 2 == 0 ? i : -i), data});
  }
  return samples;
}

void Write(const std::vector<McapSample>& samples, McapWriter& writer) {
  const uint16_t image = writer.AddTopic("/image", "sensor_msgs/CompressedImage");
  writer.AddTopic("/empty", "tf2_msgs/TFMessage");
  const uint16_t path = writer.AddTopic("/path", "nav_msgs/Path");
  for (const McapSample& s : samples)
    writer.Write(s.topic == "/image" ? image : path, s.time, s.data);
}

// How many of the samples a file begins with.
size_t CountOf(const std::string& path, const std::vector<McapSample>& samples,
               std::string& problem) {
  const auto reader = OpenRecording(path, [](const RecordedTopic&) { return kWholeMessage; });
  size_t count = 0;
  for (; const auto message = reader->Next(); ++count) {
    const McapSample& expected = samples.at(count);
    EXPECT_EQ(message->topic->name, expected.topic);
    EXPECT_EQ(message->topic->type, expected.type);
    EXPECT_EQ(message->topic->encoding, MessageEncoding::kCdr);
    EXPECT_EQ(message->log_time, expected.time);
    EXPECT_TRUE(std::ranges::equal(message->data, expected.data));
  }
  problem = reader->problem();
  return count;
}

TEST_F(McapWriting, IsReadBackAlsoUnfinished) {
  const std::vector<McapSample> samples = McapSamples();
  const std::string path = folder / "a.mcap";
  std::string problem;
  {
    McapWriter writer(path);
    Write(samples, writer);
    const size_t so_far = CountOf(path, samples, problem);
    EXPECT_GT(so_far, 10U);
    EXPECT_LT(so_far, samples.size());
    EXPECT_THAT(problem, HasSubstr("ends early"));
  }
  EXPECT_EQ(CountOf(path, samples, problem), samples.size());
  EXPECT_EQ(problem, "");
}

// The footer leads to the summary, and that to each chunk and to each message in it.
TEST_F(McapWriting, HasAnIndex) {
  const std::vector<McapSample> samples = McapSamples();
  McapWriter writer(folder / "a.mcap");
  Write(samples, writer);
  writer.Finish();
  const std::string text = folder.Read("a.mcap");
  const ByteView file{reinterpret_cast<const uint8_t*>(text.data()), text.size()};
  constexpr size_t kMagic = 8, kFooter = 9 + 20;
  RecordBytes footer(file.subspan(file.size() - kMagic - kFooter, kFooter), "footer");
  EXPECT_EQ(footer.Get<uint8_t>(), 2);
  footer.Skip(sizeof(uint64_t));
  const auto summary_at = footer.Get<uint64_t>();
  footer.Skip(sizeof(uint64_t));
  EXPECT_EQ(footer.Get<uint32_t>(),
            Crc32(file.subspan(summary_at, file.size() - kMagic - 4 - summary_at)));

  RecordBytes in(file.subspan(summary_at, file.size() - kMagic - kFooter - summary_at), "summary");
  std::map<int, int> kinds;
  size_t indexed = 0;
  while (in.left() > 0) {
    const auto kind = in.Get<uint8_t>();
    const auto length = in.Get<uint64_t>();
    ++kinds[kind];
    RecordBytes record(in.Take(length), "record");
    if (kind == 11) {
      EXPECT_EQ(record.Get<uint64_t>(), samples.size());
    }
    if (kind != 8) continue;
    const auto first = record.Get<uint64_t>(), last = record.Get<uint64_t>();
    RecordBytes chunk(file.subspan(record.Get<uint64_t>()), "chunk");
    EXPECT_EQ(chunk.Get<uint8_t>(), 6);
    chunk.Skip(3 * sizeof(uint64_t));
    const auto size = chunk.Get<uint64_t>();
    const auto crc = chunk.Get<uint32_t>();
    const std::string how = chunk.Text();
    const PlainBytes plain = Decompress(how, chunk.Take(chunk.Get<uint64_t>()), size, "chunk");
    EXPECT_EQ(Crc32(plain.view()), crc);
    record.Skip(sizeof(uint64_t));
    for (auto left = record.Get<uint32_t>(); left > 0; left -= 10) {
      const auto channel = record.Get<uint16_t>();
      RecordBytes index(file.subspan(record.Get<uint64_t>()), "index");
      EXPECT_EQ(index.Get<uint8_t>(), 7);
      index.Skip(sizeof(uint64_t));
      EXPECT_EQ(index.Get<uint16_t>(), channel);
      uint64_t earlier = 0;
      for (auto bytes = index.Get<uint32_t>(); bytes > 0; bytes -= 16, ++indexed) {
        const auto time = index.Get<uint64_t>();
        EXPECT_TRUE(first <= time && time <= last && earlier <= time);
        earlier = time;
        RecordBytes message(plain.view().subspan(index.Get<uint64_t>()), "message");
        EXPECT_EQ(message.Get<uint8_t>(), 5);
        message.Skip(sizeof(uint64_t));
        EXPECT_EQ(message.Get<uint16_t>(), channel);
        message.Skip(sizeof(uint32_t));
        EXPECT_EQ(message.Get<uint64_t>(), time);
      }
    }
  }
  EXPECT_EQ(indexed, samples.size());
  EXPECT_EQ(kinds[3], 2);  // the topic without messages is not there
  EXPECT_EQ(kinds[4], 2);
  EXPECT_GT(kinds[8], 1);
}

TEST_F(McapWriting, WhatCannotBeWrittenIsNamed) {
  EXPECT_INPUT_ERROR(McapWriter(folder / "no/a.mcap"),
                     HasSubstr("no/a.mcap: cannot be written: No such"));
  EXPECT_INPUT_ERROR(McapWriter(folder.path()), HasSubstr("cannot be written"));
  McapWriter full("/dev/full");
  EXPECT_INPUT_ERROR(Write(McapSamples(), full),
                     HasSubstr("/dev/full: cannot be written: No space"));
  full.Finish();
}

TEST_F(McapWriting, WithoutMessagesNothingChanges) {
  std::ofstream(folder / "old.mcap") << "old";
  for (const char* name : {"old.mcap", "new.mcap"})
    McapWriter(folder / name).AddTopic("/path", "nav_msgs/Path");
  EXPECT_EQ(folder.Read("old.mcap"), "old");
  EXPECT_FALSE(std::filesystem::exists(folder / "new.mcap"));
  McapWriter writer(folder / "old.mcap");
  writer.Write(writer.AddTopic("/path", "nav_msgs/Path"), -1, ByteBuffer{0, 1, 0, 0});
  writer.Finish();
  EXPECT_TRUE(folder.Read("old.mcap").starts_with("\x89MCAP0"));
}

TEST(CdrWriting, AlignsValues) {
  CdrWriter out;
  out.Put(uint8_t{1}).Put(2.0).Text("ab").Put(uint16_t{3}).Count(0).Bytes(ByteBuffer{4});
  EXPECT_THAT(
      std::vector<int>(out.bytes().begin(), out.bytes().end()),
      testing::ElementsAre(0, 1, 0, 0,                                         //
                           1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x40,  //
                           3, 0, 0, 0, 'a', 'b', 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 4));
}

TEST(RosDefinitions, HaveAllThatIsInThem) {
  const std::string line(80, '=');
  EXPECT_EQ(RosDefinition("sensor_msgs/CompressedImage"),
            "std_msgs/Header header\nstring format\nuint8[] data\n" + line +
                "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + line +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
}

}  // namespace
}  // namespace oaslam
