#include "oaslam/images/focal_metadata.h"

#include <string_view>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/image_source.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/dataset.h"
#include "oaslam/images/exif_data.h"
#include "oaslam/images/video_container.h"
#include "oaslam/recordings/recording_reader.h"

namespace oaslam {
namespace {

// The tag of Apple's devices, after "com.apple.quicktime.camera".
constexpr std::string_view kVideoTag = "focal_length.35mm_equivalent";

std::optional<double> FromExif(const std::string& path) {
  return ExifShort(LoadExif(path), EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
}

std::optional<double> FromVideo(const std::string& path) {
  const std::optional<std::string> tag = ReadVideoTag(path, kVideoTag);
  return tag ? ParseNumber(Trim(*tag)) : std::nullopt;
}

}  // namespace

std::optional<double> FocalLength35mm(const std::string& source) {
  if (IsCamera(source) || IsRecording(source)) return std::nullopt;
  try {
    const auto images = ListImages(source, {.quiet = true});
    const auto length =
        images ? FromExif(images->front().path) : FromVideo(FilmOf(source, {}).path);
    return length && CanBeFocalLength35mm(*length) ? length : std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace oaslam
