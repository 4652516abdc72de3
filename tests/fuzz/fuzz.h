#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

#include "oaslam/error.h"
#include "temp_folder.h"

// A fuzz target hands bytes to one reader. The reader may refuse them by an InputError; any other
// exception, a failed check of a sanitizer, or an input that takes longer than the limit of
// libFuzzer is a defect.
namespace oaslam::fuzz {

// For readers that take a path: the name of a file that holds the bytes. It is the same file each
// time, in a folder of this process.
inline std::string FileOf(std::string_view bytes, const std::string& name) {
  static const TempFolder folder;
  const std::string path = folder / name;
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path;
}

// What is refused counts like the rest: the inputs worth keeping are the nearly valid ones.
template <typename Read>
int Try(Read read) {
  try {
    read();
  } catch (const InputError&) {
  }
  return 0;
}

inline std::string_view Text(const uint8_t* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace oaslam::fuzz
