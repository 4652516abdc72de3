#include <map>
#include <utility>

#include "oaslam/recordings/record_nest.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

class McapReader : public RecordsReader {
 public:
  McapReader(const RecordingFile& file, BytesWanted wanted)
      : RecordsReader(file, kMcapMagic, std::move(wanted)) {}

  std::optional<RecordedMessage> Next() override {
    constexpr uint64_t kHead = 9;  // the kind, and the length of the rest
    while (true) {
      nest_.Leave();
      if (nest_.IsAtEnd(kHead)) return EndEarly();
      RecordBytes& in = nest_.in();
      const auto kind = in.Get<McapRecord>();
      const auto length = in.Get<uint64_t>();
      if (!nest_.HasAll(length) && kind != McapRecord::kChunk) return EndEarly();
      if (!nest_.is_in_chunk() && (kind == McapRecord::kDataEnd || kind == McapRecord::kFooter))
        return std::nullopt;
      nest_.Enter(length);
      if (kind == McapRecord::kSchema)
        ReadSchema(in);
      else if (kind == McapRecord::kChannel)
        ReadChannel(in);
      else if (kind == McapRecord::kMessage)
        return ReadMcapMessage(in);
      else if (kind == McapRecord::kChunk)
        ReadChunk(in);
    }
  }

 private:
  void ReadSchema(RecordBytes& in) {
    const auto id = in.Get<uint16_t>();
    schemas_[id] = in.Text();
  }

  void ReadChannel(RecordBytes& in) {
    const auto id = in.Get<uint16_t>();
    const auto schema = in.Get<uint16_t>();
    RecordedTopic topic;
    topic.name = in.Text();
    topic.encoding_name = in.Text();
    topic.encoding = topic.encoding_name == "cdr"    ? MessageEncoding::kCdr
                     : topic.encoding_name == "ros1" ? MessageEncoding::kRos1
                                                     : MessageEncoding::kOther;
    if (const auto found = schemas_.find(schema); found != schemas_.end())
      topic.type = PlainType(found->second);
    AddTopic(id, std::move(topic));
  }

  RecordedMessage ReadMcapMessage(RecordBytes& in) {
    const auto channel = in.Get<uint16_t>();
    in.Skip(sizeof(uint32_t));  // its number
    const auto log_time = static_cast<int64_t>(in.Get<uint64_t>());
    in.Skip(sizeof(uint64_t));  // when it was published
    return ReadMessage(channel, log_time, in);
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

  std::map<uint16_t, std::string> schemas_;
};

}  // namespace

std::unique_ptr<RecordingReader> OpenMcap(const RecordingFile& file, BytesWanted wanted) {
  return std::make_unique<McapReader>(file, std::move(wanted));
}

}  // namespace oaslam
