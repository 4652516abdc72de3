#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace oaslam {

// Whether the program ffmpeg is installed and has this encoder.
inline bool HasFfmpegEncoder(const std::string& name) {
  std::FILE* pipe = popen("ffmpeg -hide_banner -encoders 2>/dev/null", "r");
  std::string text;
  std::array<char, 4096> part{};
  while (const size_t count = pipe ? std::fread(part.data(), 1, part.size(), pipe) : 0)
    text.append(part.data(), count);
  if (pipe) pclose(pipe);
  return text.find(" " + name + " ") != std::string::npos;
}

// `ffmpeg ARGUMENTS`; false if it failed.
inline bool RunFfmpeg(const std::string& arguments) {
  return std::system(("ffmpeg -nostdin -hide_banner -loglevel error -y " + arguments).c_str()) == 0;
}

}  // namespace oaslam

#define OASLAM_SKIP_WITHOUT_ENCODER(name) \
  if (!::oaslam::HasFfmpegEncoder(name))  \
  GTEST_SKIP() << "needs the program ffmpeg with the encoder " << (name)
