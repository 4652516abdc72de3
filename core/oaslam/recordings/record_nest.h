#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "oaslam/recordings/containers.h"
#include "oaslam/recordings/decompression.h"

namespace oaslam {

// The position in a file of records, some of which are chunks that hold records. What is read of a
// record cannot go beyond it, nor a record beyond its chunk.
class RecordNest {
 public:
  explicit RecordNest(const RecordingFile& file) : file_(file.path, file.name) {}

  RecordBytes& in() { return content_ ? *content_ : file_; }
  const RecordBytes& in() const { return content_ ? *content_ : file_; }
  bool is_in_chunk() const { return content_ || chunk_end_ != 0; }
  // Whether the file ends in the record that is read, or in its chunk.
  bool is_cut() const { return is_cut_; }
  // Whether the file ends here, before so many bytes.
  bool IsAtEnd(uint64_t head) const { return MayEnd() && in().left() < head; }

  // Whether so many bytes are there. False where the file ends before: it is cut. Throws
  // InputError where the length cannot be right.
  bool HasAll(uint64_t length) {
    if (length <= in().left()) return true;
    if (!MayEnd() || length > kLongestRecord)
      in().Refuse(fmt::format("a record of {} bytes, where {} are left", length, in().left()));
    is_cut_ = true;
    return false;
  }

  // The next so many bytes, or what is there of them, are a record.
  void Enter(uint64_t length) {
    record_end_ = in().at() + std::min(length, in().left());
    outer_end_ = in().SetEnd(record_end_);
  }
  // Goes on behind the record that was entered last, and behind its chunk if that is at its end.
  void Leave() {
    if (record_end_ != 0) LeaveRecord();
    if (content_ && content_->left() == 0) {
      content_.reset();
      plain_ = {};
    }
    if (chunk_end_ != 0 && file_.at() == chunk_end_) {
      file_.SetEnd(file_.size());
      chunk_end_ = 0;
    }
  }

  // The rest of the record that was entered last are the records of a chunk, read where they lie.
  void EnterChunk() {
    if (in().left() == 0) return;
    chunk_end_ = record_end_;
    record_end_ = 0;
  }
  // Its records are these, which were decompressed.
  void EnterChunk(PlainBytes content, const std::string& place) {
    LeaveRecord();
    plain_ = std::move(content);
    content_.emplace(plain_.view(), place + " (in a chunk)");
  }

 private:
  bool MayEnd() const { return !content_ && (chunk_end_ == 0 || is_cut_); }
  void LeaveRecord() {
    in().Skip(record_end_ - in().at());
    in().SetEnd(outer_end_);
    record_end_ = 0;
  }

  RecordBytes file_;
  PlainBytes plain_;                    // of a chunk that was decompressed
  std::optional<RecordBytes> content_;  // of it
  // The ends of the record that is being read, of what holds it, and of a chunk that is read where
  // it lies; 0: none.
  uint64_t record_end_ = 0, outer_end_ = 0, chunk_end_ = 0;
  bool is_cut_ = false;
};

// A reader of a file of records. It reads from front to back, which needs no index and also takes
// an unfinished file.
class RecordsReader : public RecordingReader {
 public:
  std::string Place() const override { return nest_.in().Place(); }

 protected:
  RecordsReader(const RecordingFile& file, std::string_view magic, BytesWanted wanted)
      : name_(file.name), nest_(file), wanted_(std::move(wanted)) {
    nest_.in().Skip(magic.size());
  }

  // A topic may be told repeatedly, as in each chunk. It stays the same.
  void AddTopic(uint32_t id, RecordedTopic topic) {
    const size_t wanted = wanted_(topic);
    topics_.try_emplace(id, WantedTopic{std::move(topic), wanted});
  }
  // The rest of the record is a message of this topic.
  RecordedMessage ReadMessage(uint32_t id, int64_t log_time, RecordBytes& in) {
    const auto found = topics_.find(id);
    if (found == topics_.end()) in.Refuse("a message of a topic that is not there");
    const WantedTopic& known = found->second;
    return {&known.topic, log_time, in.Take(std::min<uint64_t>(known.wanted, in.left()))};
  }
  std::optional<RecordedMessage> EndEarly() {
    problem_ = fmt::format("{}: ends early, at byte {}: what comes before is used", name_,
                           nest_.in().size());
    return std::nullopt;
  }

  std::string name_;
  RecordNest nest_;

 private:
  BytesWanted wanted_;
  std::map<uint32_t, WantedTopic> topics_;
};

}  // namespace oaslam
