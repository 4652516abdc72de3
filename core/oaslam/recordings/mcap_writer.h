#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/recordings/record_bytes.h"
#include "oaslam/util/unique_fd.h"

namespace oaslam {

enum class McapRecord : uint8_t;

// Writes messages of ROS 2 as an MCAP file: in chunks with checksums, compressed by zstd, with
// indexes and a summary at the end. The file grows chunk by chunk, so that one that was not
// finished can be read from front to back. A chunk is kept in memory. What fails throws InputError,
// which names the file; nothing can be written afterwards.
class McapWriter {
 public:
  // A file that exists is replaced by the first message; without any, it is kept. `name`: what
  // errors call the file, the path unless given.
  explicit McapWriter(const std::string& path, const std::string& name = "");
  // Finishes the file if Finish was not called; errors are not reported.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  // Returns the topic's number for Write. `type`: of ros_definitions.h. A topic that gets no
  // message is not in the file.
  uint16_t AddTopic(const std::string& name, const std::string& type);
  // Adds a message in CDR. `time`: nanoseconds, also before those of earlier messages; a time below
  // 0 is written as 0.
  void Write(uint16_t topic, int64_t time, ByteView message);
  void Finish();

 private:
  struct Topic {
    std::string name, type;
    uint64_t messages = 0;
    std::vector<std::pair<uint64_t, uint64_t>> index{};  // in the chunk: times and offsets
  };
  struct Times {
    uint64_t first = UINT64_MAX, last = 0;
    void Add(uint64_t time);
  };

  void Announce(uint16_t id);
  void WriteChunk();
  ByteBuffer Statistics() const;
  void WriteRecord(McapRecord kind, const ByteBuffer& content);
  void WriteBytes(ByteView bytes);
  [[noreturn]] void Fail();  // by errno

  std::string path_, name_;
  UniqueFd file_;
  bool is_new_ = false, has_begun_ = false, is_done_ = false;
  uint64_t at_ = 0;  // bytes written
  std::vector<Topic> topics_;
  std::map<std::string, uint16_t> schemas_;  // by type, those in the file
  ByteBuffer chunk_;                         // its records
  Times chunk_times_, times_;
  uint32_t chunks_ = 0;
  ByteBuffer summary_schemas_, summary_channels_, chunk_indexes_;  // records
};

}  // namespace oaslam
