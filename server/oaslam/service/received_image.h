#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace oaslam {

enum class ImageColor { kGrey, kBgr };

// The bytes of an image in a text: base64, or a data: URL (RFC 2397) as a canvas gives it. Throws
// InputError, whose message begins with `what`.
std::string BytesOfImageText(std::string_view text, const std::string& what);
bool IsDataUrl(std::string_view text);

// The size of a JPEG or PNG image, from its header alone; the pixels as stored, whatever an EXIF
// orientation says. Throws InputError for anything else, and for more than 50 million pixels.
cv::Size SizeOfReceivedImage(std::string_view bytes);

// Decodes a JPEG or PNG image, after SizeOfReceivedImage. Throws InputError where it is damaged.
cv::Mat DecodeReceivedImage(std::string_view bytes, ImageColor color);

}  // namespace oaslam
