#include "oaslam/recordings/record_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "oaslam/util/bad_input.h"

namespace oaslam {

RecordBytes::RecordBytes(const std::string& path, std::string name)
    : place_(std::move(name)), file_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat status {};
  if (file_.get() < 0 || fstat(file_.get(), &status) != 0 || !S_ISREG(status.st_mode))
    throw BadInput("{}: {}", place_,
                   file_.get() >= 0  ? "is no file"
                   : errno == EACCES ? "may not be read"
                                     : "is not there");
  size_ = end_ = static_cast<uint64_t>(status.st_size);
}

RecordBytes::RecordBytes(ByteView memory, std::string place)
    : place_(std::move(place)), memory_(memory), end_(memory.size()), size_(memory.size()) {}

uint64_t RecordBytes::SetEnd(uint64_t end) {
  return std::exchange(end_, std::clamp(end, at_, size_));
}

void RecordBytes::Need(uint64_t count) const {
  if (count > left())
    Refuse(fmt::format("a length of {} bytes, where {} are left of what holds it", count, left()));
}

ByteView RecordBytes::Take(uint64_t count) {
  Need(count);
  const uint64_t from = at_;
  if (file_.get() < 0) {
    at_ += count;
    return memory_.subspan(from, count);
  }
  if (from < window_from_ || from + count > window_from_ + window_.size()) {
    constexpr uint64_t kAhead = 1 << 14;  // heads of records lie near each other
    if (count > kLongestRecord)
      Refuse(fmt::format("a length of {} bytes, allowed: {}", count, kLongestRecord));
    window_.resize(std::min(std::max(count, kAhead), size_ - from));
    window_from_ = from;
    for (size_t done = 0; done < window_.size();) {
      const ssize_t got = pread(file_.get(), window_.data() + done, window_.size() - done,
                                static_cast<off_t>(from + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) {
        window_.clear();
        Refuse("cannot be read");
      }
      done += static_cast<size_t>(got);
    }
  }
  at_ += count;
  return ByteView(window_).subspan(from - window_from_, count);
}

void RecordBytes::Skip(uint64_t count) {
  Need(count);
  at_ += count;
}

std::string RecordBytes::Text() {
  const ByteView bytes = Take(Get<uint32_t>());
  return {bytes.begin(), bytes.end()};
}

std::string RecordBytes::Place() const {
  return file_.get() < 0 ? place_ : fmt::format("{}: at byte {}", place_, at_);
}

void RecordBytes::Refuse(const std::string& problem) const {
  throw BadInput("{}: {}", Place(), problem);
}

}  // namespace oaslam
