#pragma once

#include <memory>
#include <string>

#include "oaslam/recordings/record_bytes.h"

namespace oaslam {

// Decompressed bytes. Pages of memory that are never written cost nothing, so that a size that is
// not true costs nothing either.
struct PlainBytes {
  std::unique_ptr<uint8_t[]> bytes;
  size_t size = 0;

  ByteView view() const { return {bytes.get(), size}; }
};

// The content of a chunk, of `size` bytes, by "zstd", "lz4" (a frame) or "bz2". Throws InputError,
// which begins with `place`, where the name is not known, the content is damaged or of another
// size, and where it is longer than kLongestRecord.
PlainBytes Decompress(const std::string& name, ByteView packed, uint64_t size,
                      const std::string& place);
// A zstd frame that tells the size of its content.
PlainBytes DecompressFrame(ByteView packed, const std::string& place);

// Writes the content of a .zst file. Throws InputError.
void DecompressFile(const std::string& from, const std::string& to);

// CRC-32 as in zip (IEEE 802.3).
uint32_t Crc32(ByteView bytes);

}  // namespace oaslam
