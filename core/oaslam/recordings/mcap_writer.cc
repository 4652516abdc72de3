#include "oaslam/recordings/mcap_writer.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "oaslam/recordings/containers.h"
#include "oaslam/recordings/decompression.h"
#include "oaslam/recordings/ros_definitions.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// A program that is killed loses less than a chunk; smaller ones compress worse.
constexpr size_t kChunkBytes = 1 << 20;
constexpr char kCompression[] = "zstd";

void Append(ByteBuffer& to, ByteView bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }

// The values of a record, one after another.
struct Content {
  ByteBuffer bytes{};

  template <typename T>
  Content& Put(T value) {
    const auto* from = reinterpret_cast<const uint8_t*>(&value);
    Append(bytes, {from, sizeof value});
    return *this;
  }
  Content& Bytes(ByteView more) {
    Append(bytes, more);
    return *this;
  }
  Content& WithLength(ByteView more) { return Put(static_cast<uint32_t>(more.size())).Bytes(more); }
  Content& Text(std::string_view text) {
    return WithLength({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  }
};

void AppendRecord(ByteBuffer& to, McapRecord kind, ByteView content) {
  Append(to, Content().Put(kind).Put(uint64_t{content.size()}).bytes);
  Append(to, content);
}

// "sensor_msgs/msg/Image" of "sensor_msgs/Image".
std::string FullType(std::string type) { return type.insert(type.find('/'), "/msg"); }

ByteBuffer Compressed(ByteView plain) {
  ByteBuffer packed(ZSTD_compressBound(plain.size()));
  const size_t size =
      ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), ZSTD_CLEVEL_DEFAULT);
  OASLAM_CHECK(!ZSTD_isError(size));
  packed.resize(size);
  return packed;
}

InputError CannotBeWritten(const std::string& name) {
  return BadInput("{}: cannot be written: {}", name, std::generic_category().message(errno));
}

}  // namespace

void McapWriter::Times::Add(uint64_t time) {
  first = std::min(first, time);
  last = std::max(last, time);
}

McapWriter::McapWriter(const std::string& path, const std::string& name)
    : path_(path), name_(name.empty() ? path : name) {
  std::error_code error;
  is_new_ = !std::filesystem::exists(path, error);
  constexpr mode_t kForAll = 0666;  // as far as the user's umask allows
  file_ = UniqueFd(open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kForAll));
  if (!file_) throw CannotBeWritten(name_);
}

McapWriter::~McapWriter() {
  try {
    Finish();
  } catch (const std::exception&) {
  }
}

uint16_t McapWriter::AddTopic(const std::string& name, const std::string& type) {
  topics_.push_back({name, type});
  return static_cast<uint16_t>(topics_.size() - 1);
}

void McapWriter::Write(uint16_t topic, int64_t time, ByteView message) {
  OASLAM_CHECK(!is_done_);
  Topic& to = topics_.at(topic);
  if (to.messages == 0) Announce(topic);
  const auto when = static_cast<uint64_t>(std::max<int64_t>(time, 0));
  chunk_times_.Add(when);
  to.index.emplace_back(when, chunk_.size());
  Content head;
  head.Put(topic).Put(static_cast<uint32_t>(to.messages++)).Put(when).Put(when);
  Append(
      chunk_,
      Content().Put(McapRecord::kMessage).Put(uint64_t{head.bytes.size() + message.size()}).bytes);
  Append(chunk_, head.bytes);
  Append(chunk_, message);
  if (chunk_.size() >= kChunkBytes) WriteChunk();
}

// The records that tell what a topic is stand before its first message, and again in the summary.
void McapWriter::Announce(uint16_t id) {
  const Topic& topic = topics_[id];
  const auto [schema, is_new] =
      schemas_.emplace(topic.type, static_cast<uint16_t>(schemas_.size() + 1));
  if (is_new) {
    const ByteBuffer content = Content()
                                   .Put(schema->second)
                                   .Text(FullType(topic.type))
                                   .Text("ros2msg")
                                   .Text(RosDefinition(topic.type))
                                   .bytes;
    AppendRecord(chunk_, McapRecord::kSchema, content);
    AppendRecord(summary_schemas_, McapRecord::kSchema, content);
  }
  constexpr uint32_t kNoMetadata = 0;
  const ByteBuffer content =
      Content().Put(id).Put(schema->second).Text(topic.name).Text("cdr").Put(kNoMetadata).bytes;
  AppendRecord(chunk_, McapRecord::kChannel, content);
  AppendRecord(summary_channels_, McapRecord::kChannel, content);
}

void McapWriter::WriteChunk() {
  if (chunk_.empty()) return;
  if (!has_begun_) {
    has_begun_ = true;
    // What cannot be cut off, as a device, is written from its beginning.
    if (ftruncate(file_.get(), 0) != 0 && errno != EINVAL) Fail();
    WriteBytes({reinterpret_cast<const uint8_t*>(kMcapMagic.data()), kMcapMagic.size()});
    WriteRecord(McapRecord::kHeader, Content().Text("ros2").Text("oaslam").bytes);
  }
  const ByteBuffer packed = Compressed(chunk_);
  const uint64_t begin = at_;
  WriteRecord(McapRecord::kChunk, Content()
                                      .Put(chunk_times_.first)
                                      .Put(chunk_times_.last)
                                      .Put(uint64_t{chunk_.size()})
                                      .Put(Crc32(chunk_))
                                      .Text(kCompression)
                                      .Put(uint64_t{packed.size()})
                                      .Bytes(packed)
                                      .bytes);
  const uint64_t end = at_;
  Content offsets;
  for (uint16_t id = 0; id < topics_.size(); ++id) {
    auto& index = topics_[id].index;
    if (index.empty()) continue;
    offsets.Put(id).Put(at_);
    std::ranges::stable_sort(index);
    Content entries;
    for (const auto& [time, offset] : index) entries.Put(time).Put(offset);
    WriteRecord(McapRecord::kMessageIndex, Content().Put(id).WithLength(entries.bytes).bytes);
    index.clear();
  }
  AppendRecord(chunk_indexes_, McapRecord::kChunkIndex,
               Content()
                   .Put(chunk_times_.first)
                   .Put(chunk_times_.last)
                   .Put(begin)
                   .Put(end - begin)
                   .WithLength(offsets.bytes)
                   .Put(at_ - end)
                   .Text(kCompression)
                   .Put(uint64_t{packed.size()})
                   .Put(uint64_t{chunk_.size()})
                   .bytes);
  times_.Add(chunk_times_.first);
  times_.Add(chunk_times_.last);
  ++chunks_;
  chunk_.clear();
  chunk_times_ = {};
}

ByteBuffer McapWriter::Statistics() const {
  Content counts;
  uint64_t messages = 0;
  uint32_t channels = 0;
  for (uint16_t id = 0; id < topics_.size(); ++id) {
    if (topics_[id].messages == 0) continue;
    counts.Put(id).Put(topics_[id].messages);
    messages += topics_[id].messages;
    ++channels;
  }
  constexpr uint32_t kAttachments = 0, kMetadata = 0;
  return Content()
      .Put(messages)
      .Put(static_cast<uint16_t>(schemas_.size()))
      .Put(channels)
      .Put(kAttachments)
      .Put(kMetadata)
      .Put(chunks_)
      .Put(times_.first)
      .Put(times_.last)
      .WithLength(counts.bytes)
      .bytes;
}

void McapWriter::Finish() {
  if (is_done_) return;
  WriteChunk();
  is_done_ = true;
  if (!has_begun_) {
    std::error_code error;
    if (is_new_) std::filesystem::remove(path_, error);
    return;
  }
  constexpr uint32_t kNoCrc = 0;
  WriteRecord(McapRecord::kDataEnd, Content().Put(kNoCrc).bytes);
  const uint64_t summary_at = at_;
  ByteBuffer summary = std::move(summary_schemas_);
  Append(summary, summary_channels_);
  AppendRecord(summary, McapRecord::kStatistics, Statistics());
  Append(summary, chunk_indexes_);
  // The checksum of the summary is that of all before it in the footer, too.
  constexpr uint64_t kNoOffsets = 0, kFooterBytes = 20;
  Append(
      summary,
      Content().Put(McapRecord::kFooter).Put(kFooterBytes).Put(summary_at).Put(kNoOffsets).bytes);
  Append(summary, Content().Put(Crc32(summary)).bytes);
  WriteBytes(summary);
  WriteBytes({reinterpret_cast<const uint8_t*>(kMcapMagic.data()), kMcapMagic.size()});
}

void McapWriter::WriteRecord(McapRecord kind, const ByteBuffer& content) {
  WriteBytes(Content().Put(kind).Put(uint64_t{content.size()}).bytes);
  WriteBytes(content);
}

void McapWriter::WriteBytes(ByteView bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(file_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail();
    at_ += static_cast<uint64_t>(written);
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
}

void McapWriter::Fail() {
  is_done_ = true;
  throw CannotBeWritten(name_);
}

}  // namespace oaslam
