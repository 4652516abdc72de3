#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "oaslam/image_source.h"

namespace oaslam {

// Whether a source is a live camera or a stream: webcam:N, usb:N, /dev/videoN, or the address of a
// network camera (rtsp://, rtsps://, http://, https://, rtmp://, udp://, srt://), or one of
// AddCameraScheme.
bool IsCamera(const std::string& source);

using OpenOwnCamera =
    std::function<std::unique_ptr<ImageSource>(const std::string&, const ImageSourceOptions&)>;
// Makes sources that begin with `scheme`, such as "ros2:", cameras of the program, which opens them
// itself. To be called before any source is opened. The images of a camera must ascend in time.
void AddCameraScheme(const std::string& scheme, OpenOwnCamera open);

// Opens a camera of AddCameraScheme, or reads one by FFmpeg. Time stamps are the stream's own, or
// when an image arrives where it has none. A stream that breaks off is reconnected for up to 30 s;
// one of known length (a video file at an address) ends. Throws InputError where it cannot be
// opened, or has no image that can be decoded.
std::unique_ptr<ImageSource> OpenStream(const std::string& source,
                                        const ImageSourceOptions& options);

// The device of the N-th camera at USB, in the order of their numbers, of those that `classes`
// (Linux: /sys/class/video4linux) lists. Throws InputError where there are fewer.
std::string UsbCamera(int number, const std::filesystem::path& classes);

}  // namespace oaslam
