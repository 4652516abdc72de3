#include "oaslam/storage/map_bytes.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>

#include "oaslam/formats/leftover.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/read_file.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

// A folder for one file. The destructor removes both.
class PassingFolder {
 public:
  PassingFolder() : leftover_(path_) {}
  ~PassingFolder() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  PassingFolder(const PassingFolder&) = delete;
  PassingFolder& operator=(const PassingFolder&) = delete;

  std::string file() const { return path_ + "/map"; }

 private:
  static std::string Create() {
    std::string path = TemporaryPattern();
    if (!mkdtemp(path.data())) throw BadInput("{}: {}", path, std::strerror(errno));
    return path;
  }

  std::string path_ = Create();
  Leftover leftover_;
};

// Errors of a file that nobody has given a name.
template <typename Action>
auto WithoutPath(const std::string& path, const Action& action) {
  try {
    return action();
  } catch (const InputError& error) {
    std::string text = error.what();
    for (size_t at = text.find(path); at != std::string::npos; at = text.find(path))
      text.replace(at, path.size(), "map");
    throw InputError(text);
  }
}

}  // namespace

std::string BytesOf(const SavedMap& saved) {
  const PassingFolder folder;
  return WithoutPath(folder.file(), [&] {
    SaveMap(folder.file(), saved);
    return ReadFile(folder.file(), std::numeric_limits<size_t>::max());
  });
}

SavedMap MapOfBytes(std::string_view bytes) {
  const PassingFolder folder;
  return WithoutPath(folder.file(), [&] {
    WriteTextFile(folder.file(), std::string(bytes));
    return LoadMap(folder.file());
  });
}

}  // namespace oaslam
