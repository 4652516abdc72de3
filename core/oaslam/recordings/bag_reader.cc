#include <map>
#include <utility>

#include "oaslam/recordings/record_nest.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// http://wiki.ros.org/Bags/Format/2.0
enum BagRecord : uint8_t { kBagMessage = 2, kBagHeader = 3, kBagChunk = 5, kBagConnection = 7 };

using BagFields = std::map<std::string, std::string, std::less<>>;

// "name=value" texts up to the end of `in`.
BagFields ReadBagFields(RecordBytes& in) {
  BagFields fields;
  while (in.left() > 0) {
    const std::string field = in.Text();
    const size_t equals = field.find('=');
    if (equals == std::string::npos) in.Refuse("a field of a header without =");
    fields.emplace(field.substr(0, equals), field.substr(equals + 1));
  }
  return fields;
}

std::string TextField(const BagFields& fields, std::string_view name, const RecordBytes& in) {
  const auto found = fields.find(name);
  if (found == fields.end()) in.Refuse(fmt::format("a record without the field {}", name));
  return found->second;
}

template <typename T>
T NumberField(const BagFields& fields, std::string_view name, const RecordBytes& in) {
  const std::string text = TextField(fields, name, in);
  if (text.size() != sizeof(T)) in.Refuse(fmt::format("{}: {} bytes", name, text.size()));
  T value;
  std::memcpy(&value, text.data(), sizeof value);
  return value;
}

class BagReader : public RecordsReader {
 public:
  BagReader(const RecordingFile& file, BytesWanted wanted)
      : RecordsReader(file, kBagMagic, std::move(wanted)) {}

  std::optional<RecordedMessage> Next() override {
    while (true) {
      nest_.Leave();
      if (nest_.IsAtEnd(1)) return nest_.is_cut() ? EndEarly() : std::nullopt;
      const std::optional<BagFields> fields = EnterRecord();
      if (!fields) return EndEarly();
      RecordBytes& in = nest_.in();
      const auto kind = NumberField<uint8_t>(*fields, "op", in);
      if (in.left() < data_size_ && kind != kBagChunk) return EndEarly();
      if (kind == kBagHeader)
        CheckEncryption(*fields);
      else if (kind == kBagConnection)
        ReadConnection(*fields, in);
      else if (kind == kBagMessage)
        return ReadBagMessage(*fields, in);
      else if (kind == kBagChunk)
        ReadChunk(*fields, in);
    }
  }

 private:
  // A length; nothing where the file ends in it.
  std::optional<uint32_t> Length() {
    if (nest_.IsAtEnd(sizeof(uint32_t))) return std::nullopt;
    return nest_.in().Get<uint32_t>();
  }

  // The fields of the next record, whose data follow; nothing where the file ends before these.
  std::optional<BagFields> EnterRecord() {
    const std::optional<uint32_t> head = Length();
    if (!head || !nest_.HasAll(*head)) return std::nullopt;
    RecordBytes& in = nest_.in();
    const uint64_t end = in.SetEnd(in.at() + *head);
    BagFields fields = ReadBagFields(in);
    in.SetEnd(end);
    const std::optional<uint32_t> data = Length();
    if (!data) return std::nullopt;
    nest_.HasAll(*data);
    nest_.Enter(*data);
    data_size_ = *data;
    return fields;
  }

  void CheckEncryption(const BagFields& fields) const {
    const auto found = fields.find("encryptor");
    if (found != fields.end() && !found->second.empty())
      throw BadInput("{}: is encrypted by {}", name_, found->second);
  }

  void ReadConnection(const BagFields& fields, RecordBytes& in) {
    RecordedTopic topic = {TextField(fields, "topic", in), "", MessageEncoding::kRos1, "ros1"};
    const auto id = NumberField<uint32_t>(fields, "conn", in);
    topic.type = TextField(ReadBagFields(in), "type", in);
    AddTopic(id, std::move(topic));
  }

  RecordedMessage ReadBagMessage(const BagFields& fields, RecordBytes& in) {
    const auto id = NumberField<uint32_t>(fields, "conn", in);
    const auto time = NumberField<uint64_t>(fields, "time", in);
    constexpr int64_t kSecond = 1'000'000'000;
    const int64_t log_time =
        static_cast<int64_t>(time & 0xffffffff) * kSecond + static_cast<int64_t>(time >> 32);
    return ReadMessage(id, log_time, in);
  }

  // A chunk that is not compressed is read where it lies.
  void ReadChunk(const BagFields& fields, RecordBytes& in) {
    if (nest_.is_in_chunk()) in.Refuse("a chunk in a chunk");
    const std::string compression = TextField(fields, "compression", in);
    if (compression == "none") return nest_.EnterChunk();
    if (nest_.is_cut()) return;
    const std::string place = in.Place();
    const auto size = NumberField<uint32_t>(fields, "size", in);
    nest_.EnterChunk(Decompress(compression, in.Take(in.left()), size, place), place);
  }

  uint64_t data_size_ = 0;  // of the record that is being read
};

}  // namespace

std::unique_ptr<RecordingReader> OpenRosBag(const RecordingFile& file, BytesWanted wanted) {
  return std::make_unique<BagReader>(file, std::move(wanted));
}

}  // namespace oaslam
