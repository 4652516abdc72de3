#include "oaslam/recordings/decompression.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// These return how many bytes the content has; another number than there is room for where it is
// damaged.

size_t FromZstd(ByteView packed, std::span<uint8_t> plain) {
  return ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
}

size_t FromLz4(ByteView packed, std::span<uint8_t> plain) {
  LZ4F_dctx* made = nullptr;
  LZ4F_createDecompressionContext(&made, LZ4F_VERSION);
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, LZ4F_freeDecompressionContext);
  size_t done = 0;
  while (true) {
    size_t read = packed.size(), written = plain.size() - done;
    const size_t rest = LZ4F_decompress(context.get(), plain.data() + done, &written, packed.data(),
                                        &read, nullptr);
    if (LZ4F_isError(rest) != 0) return 0;
    done += written;
    packed = packed.subspan(read);
    if (rest == 0 || read + written == 0) return done;
  }
}

size_t FromBz2(ByteView packed, std::span<uint8_t> plain) {
  auto size = static_cast<unsigned>(plain.size());
  const int result =
      BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(plain.data()), &size,
                                 reinterpret_cast<char*>(const_cast<uint8_t*>(packed.data())),
                                 static_cast<unsigned>(packed.size()), 0, 0);
  return result == BZ_OK ? size : 0;
}

std::array<std::array<uint32_t, 256>, 8> MakeCrcTables() {
  constexpr uint32_t kPolynomial = 0xedb88320;
  std::array<std::array<uint32_t, 256>, 8> tables{};
  for (uint32_t i = 0; i < 256; ++i) {
    uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1) != 0 ? kPolynomial : 0);
    tables[0][i] = value;
  }
  for (size_t k = 1; k < tables.size(); ++k)
    for (size_t i = 0; i < 256; ++i)
      tables[k][i] = (tables[k - 1][i] >> 8) ^ tables[0][tables[k - 1][i] & 0xff];
  return tables;
}

}  // namespace

PlainBytes Decompress(const std::string& name, ByteView packed, uint64_t size,
                      const std::string& place) {
  const auto from = name == "zstd"  ? FromZstd
                    : name == "lz4" ? FromLz4
                    : name == "bz2" ? FromBz2
                                    : nullptr;
  if (!from)
    throw BadInput("{}: compressed by \"{}\", allowed: zstd, lz4, bz2", place, name.substr(0, 20));
  if (size > kLongestRecord)
    throw BadInput("{}: a chunk of {} bytes, allowed: {}", place, size, kLongestRecord);
  PlainBytes plain{std::make_unique_for_overwrite<uint8_t[]>(size), size};
  if (size > 0 && from(packed, {plain.bytes.get(), size}) != size)
    throw BadInput("{}: its compressed content is damaged, expected {} bytes", place, size);
  return plain;
}

PlainBytes DecompressFrame(ByteView packed, const std::string& place) {
  // What does not tell its size tells one that is not allowed.
  return Decompress("zstd", packed, ZSTD_getFrameContentSize(packed.data(), packed.size()), place);
}

void DecompressFile(const std::string& from, const std::string& to) {
  constexpr uint64_t kPiece = 1 << 20;
  RecordBytes file(from, from);
  std::ofstream out(to, std::ios::binary);
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          ZSTD_freeDStream);
  std::string piece(kPiece, '\0');
  while (file.left() > 0 && out) {
    const ByteView packed = file.Take(std::min(file.left(), kPiece));
    ZSTD_inBuffer in{packed.data(), packed.size(), 0};
    // Once the output is not full, all is written that these bytes give.
    for (bool is_full = true; in.pos < in.size || is_full;) {
      ZSTD_outBuffer plain{piece.data(), piece.size(), 0};
      if (ZSTD_isError(ZSTD_decompressStream(stream.get(), &plain, &in)) != 0)
        throw BadInput("{}: its compressed content is damaged", from);
      is_full = plain.pos == plain.size;
      out.write(piece.data(), static_cast<std::streamsize>(plain.pos));
    }
  }
  if (!out.flush())
    throw BadInput("{}: no room to decompress it in the folder of temporary files (TMPDIR)", from);
}

uint32_t Crc32(ByteView bytes) {
  static const std::array<std::array<uint32_t, 256>, 8> kTables = MakeCrcTables();
  uint32_t crc = ~uint32_t{0};
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    uint64_t word;
    std::memcpy(&word, bytes.data(), sizeof word);
    word ^= crc;
    crc = 0;
    for (size_t i = 0; i < 8; ++i) crc ^= kTables[7 - i][(word >> (8 * i)) & 0xff];
  }
  for (const uint8_t byte : bytes) crc = (crc >> 8) ^ kTables[0][(crc ^ byte) & 0xff];
  return ~crc;
}

}  // namespace oaslam
