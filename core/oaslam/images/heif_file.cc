#include "oaslam/images/heif_file.h"

#include <libheif/heif.h>

#include <algorithm>
#include <array>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "oaslam/util/bad_input.h"
#include "oaslam/util/free_by.h"

namespace oaslam {
namespace {

using HeifContext = std::unique_ptr<heif_context, FreeBy<heif_context_free>>;
using HeifHandle = std::unique_ptr<heif_image_handle, FreeBy<heif_image_handle_release>>;
using HeifImage = std::unique_ptr<heif_image, FreeBy<heif_image_release>>;
using HeifOptions = std::unique_ptr<heif_decoding_options, FreeBy<heif_decoding_options_free>>;

struct OpenedHeif {
  HeifContext context;
  HeifHandle handle;  // null where the file is damaged
};

// The bytes must outlive the result.
OpenedHeif OpenHeif(const std::vector<char>& bytes) {
  OpenedHeif file{HeifContext(heif_context_alloc()), nullptr};
  heif_image_handle* handle = nullptr;
  if (heif_context_read_from_memory_without_copy(file.context.get(), bytes.data(), bytes.size(),
                                                 nullptr)
              .code == heif_error_Ok &&
      heif_context_get_primary_image_handle(file.context.get(), &handle).code == heif_error_Ok)
    file.handle.reset(handle);
  return file;
}

// The major brand, which stands in the first box behind its size and "ftyp"; empty: no such file.
std::string_view BrandOf(const std::vector<char>& bytes) {
  constexpr size_t kBox = 12;
  const std::string_view head(bytes.data(), std::min(bytes.size(), kBox));
  return head.size() == kBox && head.substr(4, 4) == "ftyp" ? head.substr(8) : std::string_view();
}

// Whether this system decodes what is usual in a file of this brand.
bool HasDecoderFor(const std::vector<char>& bytes) {
  const std::string_view brand = BrandOf(bytes);
  const bool is_avif = brand.starts_with("avi"), is_any = brand == "mif1" || brand == "msf1";
  return (!is_avif && heif_have_decoder_for_format(heif_compression_HEVC)) ||
         ((is_avif || is_any) && heif_have_decoder_for_format(heif_compression_AV1));
}

}  // namespace

bool IsHeif(const std::vector<char>& bytes) {
  constexpr std::array<std::string_view, 8> kBrands = {"heic", "heix", "heim", "heis",
                                                       "mif1", "msf1", "avif", "avis"};
  return std::ranges::count(kBrands, BrandOf(bytes)) > 0;
}

cv::Mat DecodeHeif(const std::vector<char>& bytes, bool color, Orientation orientation,
                   const std::string& path) {
  const OpenedHeif file = OpenHeif(bytes);
  if (!file.handle) return {};
  const HeifOptions options(heif_decoding_options_alloc());
  options->ignore_transformations = orientation == Orientation::kStored;
  heif_image* decoded = nullptr;
  const heif_error error = heif_decode_image(file.handle.get(), &decoded, heif_colorspace_RGB,
                                             heif_chroma_interleaved_RGB, options.get());
  const HeifImage image(decoded);
  if (error.code != heif_error_Ok && !HasDecoderFor(bytes))
    throw BadInput(
        "{}: this system has no decoder for it: install libheif's (HEIC: "
        "libheif-plugin-libde265, AVIF: libheif-plugin-dav1d), or convert it to JPEG",
        path);
  if (error.code != heif_error_Ok) return {};
  int stride = 0;
  const uint8_t* data =
      heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
  if (!data) return {};
  const cv::Mat rgb(heif_image_get_height(image.get(), heif_channel_interleaved),
                    heif_image_get_width(image.get(), heif_channel_interleaved), CV_8UC3,
                    const_cast<uint8_t*>(data), static_cast<size_t>(stride));
  cv::Mat result;
  cv::cvtColor(rgb, result, color ? cv::COLOR_RGB2BGR : cv::COLOR_RGB2GRAY);
  return result;
}

std::vector<unsigned char> ExifOfHeif(const std::vector<char>& bytes) {
  const OpenedHeif file = OpenHeif(bytes);
  heif_item_id id = 0;
  if (!file.handle ||
      heif_image_handle_get_list_of_metadata_block_IDs(file.handle.get(), "Exif", &id, 1) != 1)
    return {};
  std::vector<unsigned char> block(heif_image_handle_get_metadata_size(file.handle.get(), id));
  constexpr size_t kOffset =
      4;  // bytes that tell where the TIFF header is (ISO/IEC 23008-12, A.2.1)
  if (block.size() <= kOffset ||
      heif_image_handle_get_metadata(file.handle.get(), id, block.data()).code != heif_error_Ok)
    return {};
  size_t at = 0;
  for (size_t i = 0; i < kOffset; ++i) at = at << 8 | block[i];
  at += kOffset;
  if (at >= block.size()) return {};
  std::vector<unsigned char> exif = {'E', 'x', 'i', 'f', 0, 0};
  exif.insert(exif.end(), block.begin() + static_cast<std::ptrdiff_t>(at), block.end());
  return exif;
}

}  // namespace oaslam
