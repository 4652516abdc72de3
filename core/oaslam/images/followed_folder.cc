#include "oaslam/images/followed_folder.h"

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
#include <utility>

#include "oaslam/formats/time_unit.h"
#include "oaslam/images/bit_depth.h"
#include "oaslam/images/image_files.h"
#include "oaslam/util/bad_input.h"
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
    throw BadInput("{}: cannot be followed: {}", folder, why);
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

constexpr int kLeastBits = 10;  // of the first image alone, which may be dark

class FollowedFolder : public ImageSource {
 public:
  FollowedFolder(const std::string& folder, const ImageSourceOptions& options)
      : folder_(folder),
        options_(options),
        fps_(options.fps.value_or(kDefaultFps)),
        watch_(folder),
        last_arrival_(Clock::now()) {
    AddAllImages();  // after the watch has begun, so that no image is missed
  }

  std::optional<InputImage> Next() override {
    while (!IsStopped()) {
      if (options_.to >= 0 && index_ >= options_.to) return std::nullopt;
      if (!waiting_.empty()) {
        const auto [time, name] = *waiting_.begin();
        waiting_.erase(waiting_.begin());
        if (index_ < options_.from) {
          taken_.insert(name);
          ++index_;
          continue;
        }
        const std::string path = (fs::path(folder_) / name).string();
        if (index_ == options_.from)
          bits_ = LookAtImages(folder_, {path}, options_.quiet, kLeastBits);
        InputImage image{index_, unit_ && !options_.fps ? time : index_ / fps_, name,
                         ReadImage(path, options_.color, options_.orientation, bits_)};
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
  struct Waiting {
    double time = 0;  // in its name, seconds; 0 where names are no times
    std::string name;
    bool operator<(const Waiting& other) const {
      return time != other.time ? time < other.time : NaturalLess(name, other.name);
    }
  };

  bool IsStopped() const { return is_stopped_ || (options_.stopped && options_.stopped()); }

  // The first images tell whether names are times, and in what unit.
  void Arrive(const std::vector<std::string>& names) {
    if (names.empty()) return;
    last_arrival_ = Clock::now();
    if (std::exchange(is_first_, false))
      if (const auto times = TimesOfNames(names, options_.time_unit)) {
        unit_ = times->unit;
        if (!options_.quiet)
          Log(LogLevel::kInfo, "{}: the names of the images are taken as times, in {}", folder_,
              NameOfUnit(*unit_));
      }
    for (const std::string& name : names) Arrive(name);
  }

  void Arrive(const std::string& name) {
    if (taken_.contains(name)) return;
    double time = 0;
    if (unit_) {
      const auto times = TimesOfNames({name}, unit_);
      if (!times)
        return Log(LogLevel::kWarning, "{}: its name is no time as those before are, passed over",
                   (fs::path(folder_) / name).string());
      time = times->seconds.front();
      if (last_time_ && !options_.time_unit)
        if (const std::string problem = ProblemOfSteps({*last_time_, time}); !problem.empty())
          throw BadInput("{}: {}", folder_, problem);
      last_time_ = time;
    }
    waiting_.insert({time, name});
  }

  void AddAllImages() {
    Arrive(ImageNames(folder_));
    if (fs::exists(fs::path(folder_) / kStopFile)) has_ended_ = true;
  }

  // False when nothing more will come.
  bool WaitForMore() {
    // Interval at which `stopped` is checked; Ctrl-C feels immediate.
    constexpr int kSlice_ms = 100;
    FolderWatch::Changes changes = watch_.Wait(kSlice_ms);
    std::vector<std::string> images;
    for (const std::string& name : changes.names) {
      if (name == kStopFile) has_ended_ = true;
      if (HasImageExtension(name) && !IsHelperFile(name)) images.push_back(name);
    }
    Arrive(images);
    if (changes.is_gone) {
      Log(LogLevel::kWarning, "{}: the folder is gone", folder_);
      has_ended_ = true;
    } else if (changes.is_lossy) {
      AddAllImages();
    }
    // Checked after the queue was read, since images that arrived while the caller was busy were
    // still in the kernel's queue.
    const double quiet_s = std::chrono::duration<double>(Clock::now() - last_arrival_).count();
    if (!waiting_.empty() || options_.follow->quiet_s == 0 || quiet_s <= options_.follow->quiet_s)
      return true;
    Log(LogLevel::kInfo, "{}: no image for {:g} s, no more are expected", folder_,
        options_.follow->quiet_s);
    return false;
  }

  std::string folder_;
  ImageSourceOptions options_;
  double fps_;
  FolderWatch watch_;
  std::set<Waiting> waiting_;        // images that exist and are not taken yet
  bool is_first_ = true;             // no image has come yet
  std::optional<double> unit_;       // of times in names, seconds; empty: they are no times
  std::optional<double> last_time_;  // of the image that came last, if names are times
  std::set<std::string> taken_;
  // Arrival of the last image read from the queue; initially the start.
  Clock::time_point last_arrival_;
  int index_ = 0;
  int bits_ = 16;  // that images of 16 use, by the first
  bool has_ended_ = false;
  std::atomic<bool> is_stopped_ = false;
};

}  // namespace

std::unique_ptr<ImageSource> FollowFolder(const std::string& folder,
                                          const ImageSourceOptions& options) {
  return std::make_unique<FollowedFolder>(folder, options);
}

}  // namespace oaslam
