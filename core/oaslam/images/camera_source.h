#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "oaslam/image_source.h"

namespace oaslam {

// Whether a source is a live camera or a stream: webcam:N, usb:N, /dev/videoN, or the address of a
// network camera (rtsp://, rtsps://, http://, https://, rtmp://, udp://, srt://).
bool IsCamera(const std::string& source);

// Reads a camera by FFmpeg. Time stamps are the stream's own, or when an image arrives where it has
// none. A stream that breaks off is reconnected for up to 30 s; one of known length (a video file
// at an address) ends. Throws InputError where it cannot be opened, or has no image that can be
// decoded.
std::unique_ptr<ImageSource> OpenStream(const std::string& source,
                                        const ImageSourceOptions& options);

// The device of the N-th camera at USB, in the order of their numbers, of those that `classes`
// (Linux: /sys/class/video4linux) lists. Throws InputError where there are fewer.
std::string UsbCamera(int number, const std::filesystem::path& classes);

}  // namespace oaslam
