#include "oaslam/images/followed_folder.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <set>

#include "oaslam/error.h"
#include "oaslam/images/image_files.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Watches a folder by inotify(7).
class FolderWatch {
 public:
  explicit FolderWatch(const std::string& folder)
      : descriptor_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
    constexpr uint32_t kMask =
        IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR;
    if (descriptor_ >= 0 && inotify_add_watch(descriptor_, folder.c_str(), kMask) >= 0) return;
    const std::string why = std::strerror(errno);
    if (descriptor_ >= 0) close(descriptor_);
    throw InputError(fmt::format("{}: cannot be followed: {}", folder, why));
  }
  ~FolderWatch() { close(descriptor_); }
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;

  struct Changes {
    std::vector<std::string> names;  // names of complete files
    bool is_gone = false;            // the folder itself was removed
    bool is_lossy = false;           // the kernel's queue overflowed
  };

  // Waits until something happens, `wait_ms` at most.
  Changes Wait(int wait_ms) {
    pollfd ready{descriptor_, POLLIN, 0};
    Changes changes;
    if (poll(&ready, 1, wait_ms) <= 0) return changes;
    alignas(inotify_event) std::array<char, 16384> buffer;  // some hundred names at once
    ssize_t size = 0;
    while ((size = read(descriptor_, buffer.data(), buffer.size())) > 0)
      for (const char* at = buffer.data(); at < buffer.data() + size;) {
        const auto* event = reinterpret_cast<const inotify_event*>(at);
        if (event->mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_IGNORED | IN_UNMOUNT))
          changes.is_gone = true;
        if (event->mask & IN_Q_OVERFLOW) changes.is_lossy = true;
        if (event->len > 0 && !(event->mask & IN_ISDIR)) changes.names.emplace_back(event->name);
        at += sizeof(inotify_event) + event->len;
      }
    return changes;
  }

 private:
  int descriptor_;
};

class FollowedFolder : public ImageSource {
 public:
  FollowedFolder(const std::string& folder, const ImageSourceOptions& options, double fps)
      : folder_(folder), options_(options), fps_(fps), watch_(folder), last_arrival_(Clock::now()) {
    AddAllImages();  // after the watch has begun, so that no image is missed
  }

  std::optional<InputImage> Next() override {
    while (!IsStopped()) {
      if (options_.to >= 0 && index_ >= options_.to) return std::nullopt;
      if (!waiting_.empty()) {
        const std::string name = *waiting_.begin();
        waiting_.erase(waiting_.begin());
        if (index_ < options_.from) {
          taken_.insert(name);
          ++index_;
          continue;
        }
        const std::string path = (fs::path(folder_) / name).string();
        InputImage image{index_, index_ / fps_, name,
                         ReadImage(path, options_.color, options_.orientation)};
        // An image that cannot be read is tried again, with the same index, when its writer closes
        // it.
        if (!image.image.empty()) {
          taken_.insert(name);
          ++index_;
        }
        return image;
      }
      if (has_ended_ || !WaitForMore()) return std::nullopt;
    }
    return std::nullopt;
  }
  int size() const override {
    return options_.to < 0 ? -1 : std::max(options_.to - options_.from, 0);
  }
  void Stop() override { is_stopped_ = true; }

 private:
  struct Natural {
    bool operator()(const std::string& a, const std::string& b) const { return NaturalLess(a, b); }
  };

  bool IsStopped() const { return is_stopped_ || (options_.stopped && options_.stopped()); }

  void Arrive(std::string name) {
    if (taken_.contains(name)) return;
    waiting_.insert(std::move(name));
    last_arrival_ = Clock::now();
  }

  void AddAllImages() {
    for (std::string& name : ImageNames(folder_)) Arrive(std::move(name));
    if (fs::exists(fs::path(folder_) / kStopFile)) has_ended_ = true;
  }

  // False when nothing more will come.
  bool WaitForMore() {
    // Interval at which `stopped` is checked; Ctrl-C feels immediate.
    constexpr int kSlice_ms = 100;
    FolderWatch::Changes changes = watch_.Wait(kSlice_ms);
    for (std::string& name : changes.names) {
      if (name == kStopFile) has_ended_ = true;
      if (HasImageExtension(name)) Arrive(std::move(name));
    }
    if (changes.is_gone) {
      Log(LogLevel::kWarning, fmt::format("{}: the folder is gone", folder_));
      has_ended_ = true;
    } else if (changes.is_lossy) {
      AddAllImages();
    }
    // Checked after the queue was read, since images that arrived while the caller was busy were
    // still in the kernel's queue.
    const double quiet_s = std::chrono::duration<double>(Clock::now() - last_arrival_).count();
    if (!waiting_.empty() || options_.follow->quiet_s == 0 || quiet_s <= options_.follow->quiet_s)
      return true;
    Log(LogLevel::kInfo, fmt::format("{}: no image for {:g} s, no more are expected", folder_,
                                     options_.follow->quiet_s));
    return false;
  }

  std::string folder_;
  ImageSourceOptions options_;
  double fps_;
  FolderWatch watch_;
  std::set<std::string, Natural> waiting_;  // names of images that exist and are not taken yet
  std::set<std::string> taken_;
  // Arrival of the last image read from the queue; initially the start.
  Clock::time_point last_arrival_;
  int index_ = 0;
  bool has_ended_ = false;
  std::atomic<bool> is_stopped_ = false;
};

}  // namespace

std::unique_ptr<ImageSource> FollowFolder(const std::string& folder,
                                          const ImageSourceOptions& options, double fps) {
  return std::make_unique<FollowedFolder>(folder, options, fps);
}

}  // namespace oaslam
