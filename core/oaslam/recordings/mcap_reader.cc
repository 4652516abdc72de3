#include <algorithm>
#include <map>
#include <utility>

#include "oaslam/recordings/containers.h"
#include "oaslam/recordings/decompression.h"
#include "oaslam/recordings/record_nest.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

struct McapChannel {
  RecordedTopic topic;
  size_t wanted = 0;  // bytes
};

// Reads from front to back, which needs no index and also takes an unfinished file.
class McapReader : public RecordingReader {
 public:
  McapReader(const RecordingFile& file, BytesWanted wanted)
      : name_(file.name), wanted_(std::move(wanted)), nest_(file.path, file.name) {
    nest_.in().Skip(kMcapMagic.size());
  }

  std::optional<RecordedMessage> Next() override {
    constexpr uint64_t kHead = 9;  // the kind, and the length of the rest
    while (true) {
      nest_.Leave();
      if (nest_.IsAtEnd(kHead)) return End();
      RecordBytes& in = nest_.in();
      const auto kind = in.Get<McapRecord>();
      const auto length = in.Get<uint64_t>();
      if (!nest_.HasAll(length) && kind != McapRecord::kChunk) return End();
      if (!nest_.is_in_chunk() && (kind == McapRecord::kDataEnd || kind == McapRecord::kFooter))
        return std::nullopt;
      nest_.Enter(length);
      if (kind == McapRecord::kSchema)
        ReadSchema(in);
      else if (kind == McapRecord::kChannel)
        ReadChannel(in);
      else if (kind == McapRecord::kMessage)
        return ReadMessage(in);
      else if (kind == McapRecord::kChunk)
        ReadChunk(in);
    }
  }

  std::string Place() const override { return nest_.in().Place(); }

 private:
  void ReadSchema(RecordBytes& in) {
    const auto id = in.Get<uint16_t>();
    schemas_[id] = in.Text();
  }

  void ReadChannel(RecordBytes& in) {
    const auto id = in.Get<uint16_t>();
    const auto schema = in.Get<uint16_t>();
    McapChannel channel;
    channel.topic.name = in.Text();
    channel.topic.encoding_name = in.Text();
    channel.topic.encoding = channel.topic.encoding_name == "cdr"    ? MessageEncoding::kCdr
                             : channel.topic.encoding_name == "ros1" ? MessageEncoding::kRos1
                                                                     : MessageEncoding::kOther;
    if (const auto found = schemas_.find(schema); found != schemas_.end())
      channel.topic.type = PlainType(found->second);
    channel.wanted = wanted_(channel.topic);
    // A channel is repeated in each chunk. It stays the same.
    channels_.try_emplace(id, std::move(channel));
  }

  RecordedMessage ReadMessage(RecordBytes& in) {
    const auto channel = channels_.find(in.Get<uint16_t>());
    if (channel == channels_.end()) in.Refuse("a message of a channel that is not there");
    in.Skip(sizeof(uint32_t));  // its number
    const auto log_time = static_cast<int64_t>(in.Get<uint64_t>());
    in.Skip(sizeof(uint64_t));  // when it was published
    const McapChannel& known = channel->second;
    return {&known.topic, log_time, in.Take(std::min<uint64_t>(known.wanted, in.left()))};
  }

  // A chunk that is not compressed is read where it lies.
  void ReadChunk(RecordBytes& in) {
    constexpr uint64_t kLongestHead = 64;
    if (nest_.is_in_chunk()) in.Refuse("a chunk in a chunk");
    if (nest_.is_cut() && in.left() < kLongestHead) return;
    const std::string place = in.Place();
    in.Skip(2 * sizeof(uint64_t));  // its first and last time
    const auto size = in.Get<uint64_t>();
    const auto crc = in.Get<uint32_t>();
    const std::string compression = in.Text();
    const auto length = in.Get<uint64_t>();
    if (length != in.left() && !nest_.is_cut())
      in.Refuse(fmt::format("a chunk of {} bytes in a record that has {}", length, in.left()));
    if (compression.empty()) {
      if (crc != 0 && !nest_.is_cut()) {
        CheckCrc(in.Take(length), crc, place);
        in.GoBack(length);
      }
      return nest_.EnterChunk();
    }
    if (nest_.is_cut()) return;
    PlainBytes plain = Decompress(compression, in.Take(length), size, place);
    CheckCrc(plain.view(), crc, place);
    nest_.EnterChunk(std::move(plain), place);
  }

  // 0: the recorder made none.
  static void CheckCrc(ByteView records, uint32_t crc, const std::string& place) {
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    if (crc == 0) return;
    if (const uint32_t found = Crc32(records); found != crc)
      throw BadInput("{}: a damaged chunk: its checksum is {:08x}, expected {:08x}", place, found,
                     crc);
#else
    (void)records, (void)crc, (void)place;
#endif
  }

  std::optional<RecordedMessage> End() {
    problem_ = fmt::format("{}: ends early, at byte {}: what comes before is used", name_,
                           nest_.in().size());
    return std::nullopt;
  }

  std::string name_;
  BytesWanted wanted_;
  RecordNest nest_;
  std::map<uint16_t, std::string> schemas_;
  std::map<uint16_t, McapChannel> channels_;
};

}  // namespace

std::unique_ptr<RecordingReader> OpenMcap(const RecordingFile& file, BytesWanted wanted) {
  return std::make_unique<McapReader>(file, std::move(wanted));
}

}  // namespace oaslam
