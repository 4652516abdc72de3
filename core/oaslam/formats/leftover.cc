#include "oaslam/formats/leftover.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// A signal handler can read this without a lock. Who takes a path out of its place owns it. More at
// once are not expected; they are not removed.
std::array<std::atomic<char*>, 64> leftovers{};
static_assert(std::atomic<char*>::is_always_lock_free);

}  // namespace

Leftover::Leftover(const std::string& path) {
  if (path.empty()) return;
  char* copy = strdup(path.c_str());
  for (size_t i = 0; copy && i < leftovers.size(); ++i)
    if (char* free_place = nullptr; leftovers[i].compare_exchange_strong(free_place, copy)) {
      place_ = static_cast<int>(i);
      return;
    }
  std::free(copy);
}

Leftover::~Leftover() {
  if (place_ >= 0) std::free(leftovers[static_cast<size_t>(place_)].exchange(nullptr));
}

void RemoveLeftovers() noexcept {
  // From the last to the first: a folder was noted before what is in it.
  for (size_t i = leftovers.size(); i-- > 0;)
    if (char* path = leftovers[i].exchange(nullptr)) {
      if (unlink(path) != 0) rmdir(path);
      // A signal handler must not free it: it goes back to the one who does.
      char* free_place = nullptr;
      leftovers[i].compare_exchange_strong(free_place, path);
    }
}

std::string TemporaryPattern() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) throw BadInput("the folder for temporary files: {}", error.message());
  return (folder / "oaslam-XXXXXX").string();
}

}  // namespace oaslam
