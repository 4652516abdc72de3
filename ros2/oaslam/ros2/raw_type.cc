#include "oaslam/ros2/raw_type.h"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstring>
#include <memory>

// The functions that CycloneDDS asks of a type of a program's own (ddsi_serdata.h, ddsi_sertype.h).
// They have no keys, so that all samples of a topic are of one instance.

namespace oaslam {
namespace {

// DDS reads up to the next multiple of four bytes.
size_t Padded(size_t size) { return (size + 3) / 4 * 4; }

struct RawSample : ddsi_serdata {
  RawSample(const ddsi_sertype* its_type, ddsi_serdata_kind its_kind, size_t its_size)
      : ddsi_serdata{}, size(its_size), bytes(Padded(its_size)) {
    ddsi_serdata_init(this, its_type, its_kind);
  }
  size_t size;
  ByteBuffer bytes;
};

const RawSample& Raw(const ddsi_serdata* sample) { return *static_cast<const RawSample*>(sample); }

ddsi_serdata* NewKey(const ddsi_sertype* type) { return new RawSample(type, SDK_KEY, 0); }

bool HasEqualKey(const ddsi_serdata*, const ddsi_serdata*) { return true; }

uint32_t SizeOf(const ddsi_serdata* sample) { return static_cast<uint32_t>(Raw(sample).size); }

// What arrived: fragments, which may overlap.
ddsi_serdata* FromFragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                            const nn_rdata* fragment, size_t size) {
  constexpr size_t kMost = size_t{1} << 28;  // bytes; an image of 64 megapixels in colour
  if (size > kMost) return nullptr;
  auto sample = std::make_unique<RawSample>(type, kind, size);
  size_t at = 0;
  for (; fragment && at < size; fragment = fragment->nextfrag) {
    const size_t end = std::min<size_t>(fragment->maxp1, size);
    if (end <= at) continue;
    if (fragment->min > at) return nullptr;
    const uint8_t* payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)) + (at - fragment->min);
    std::memcpy(sample->bytes.data() + at, payload, end - at);
    at = end;
  }
  return at == size ? sample.release() : nullptr;
}

ddsi_serdata* FromPieces(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                         const ddsrt_iovec_t* pieces, size_t size) {
  auto sample = std::make_unique<RawSample>(type, kind, size);
  size_t at = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && at < size; ++i) {
    const size_t length = std::min<size_t>(pieces[i].iov_len, size - at);
    std::memcpy(sample->bytes.data() + at, pieces[i].iov_base, length);
    at += length;
  }
  return sample.release();
}

ddsi_serdata* FromKeyHash(const ddsi_sertype* type, const ddsi_keyhash*) { return NewKey(type); }

ddsi_serdata* FromView(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* view) {
  if (kind != SDK_DATA) return NewKey(type);
  const ByteView bytes = *static_cast<const ByteView*>(view);
  auto* sample = new RawSample(type, kind, bytes.size());
  std::ranges::copy(bytes, sample->bytes.begin());
  return sample;
}

void CopyTo(const ddsi_serdata* sample, size_t from, size_t size, void* to) {
  std::memcpy(to, Raw(sample).bytes.data() + from, size);
}

ddsi_serdata* Lend(const ddsi_serdata* sample, size_t from, size_t size, ddsrt_iovec_t* to) {
  to->iov_base = const_cast<uint8_t*>(Raw(sample).bytes.data()) + from;
  to->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(sample);
}

void TakeBack(ddsi_serdata* sample, const ddsrt_iovec_t*) { ddsi_serdata_unref(sample); }

// Nobody asks for a sample as a struct.
bool ToStruct(const ddsi_serdata*, void*, void**, void*) { return false; }
bool KeyToStruct(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return true; }

ddsi_serdata* ToKey(const ddsi_serdata* sample) {
  ddsi_serdata* key = NewKey(sample->type);
  key->type = nullptr;
  return key;
}

void Free(ddsi_serdata* sample) { delete static_cast<RawSample*>(sample); }

size_t Print(const ddsi_sertype*, const ddsi_serdata*, char* text, size_t size) {
  if (size > 0) *text = '\0';
  return 0;
}

void KeyHashOf(const ddsi_serdata*, ddsi_keyhash* hash, bool) {
  std::memset(hash->value, 0, sizeof hash->value);
}

constexpr ddsi_serdata_ops SampleFunctions() {
  ddsi_serdata_ops ops{};
  ops.eqkey = HasEqualKey;
  ops.get_size = SizeOf;
  ops.from_ser = FromFragments;
  ops.from_ser_iov = FromPieces;
  ops.from_keyhash = FromKeyHash;
  ops.from_sample = FromView;
  ops.to_ser = CopyTo;
  ops.to_ser_ref = Lend;
  ops.to_ser_unref = TakeBack;
  ops.to_sample = ToStruct;
  ops.to_untyped = ToKey;
  ops.untyped_to_sample = KeyToStruct;
  ops.free = Free;
  ops.print = Print;
  ops.get_keyhash = KeyHashOf;
  return ops;
}
constexpr ddsi_serdata_ops kSampleFunctions = SampleFunctions();

void FreeType(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}
void ZeroStructs(const ddsi_sertype*, void*, size_t) {}
void AllocateStructs(void** structs, const ddsi_sertype*, void*, size_t, size_t count) {
  std::fill_n(structs, count, nullptr);
}
void FreeStructs(const ddsi_sertype*, void**, size_t, dds_free_op_t) {}
// Types of one name.
bool IsEqual(const ddsi_sertype*, const ddsi_sertype*) { return true; }
uint32_t HashOf(const ddsi_sertype*) { return 0; }

ddsi_sertype_ops TypeFunctions() {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = FreeType;
  ops.zero_samples = ZeroStructs;
  ops.realloc_samples = AllocateStructs;
  ops.free_samples = FreeStructs;
  ops.equal = IsEqual;
  ops.hash = HashOf;
  return ops;
}

}  // namespace

ddsi_sertype* NewRawType(const std::string& type) {
  static const ddsi_sertype_ops functions = TypeFunctions();
  auto* raw = new ddsi_sertype{};
  constexpr bool kHasNoKey = true;
  ddsi_sertype_init(raw, type.c_str(), &functions, &kSampleFunctions, kHasNoKey);
  raw->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return raw;
}

ByteView BytesOf(const ddsi_serdata& sample) {
  return ByteView(Raw(&sample).bytes).first(Raw(&sample).size);
}

}  // namespace oaslam
