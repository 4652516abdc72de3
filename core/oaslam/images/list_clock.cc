#include "oaslam/images/list_clock.h"

#include <algorithm>

#include "oaslam/formats/time_unit.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Images [first, end) whose times restart.
struct Restart {
  size_t first = 0, end = 0;
  double back_s = 0, offset_s = 0;  // offset: with it, they follow the image before after a step
};

// Whether several images from `first` on follow each other, all of them before `last`; one or two
// of those are out of order.
bool RestartsAt(const std::vector<double>& times, size_t first, double last) {
  constexpr size_t kLeast = 5;
  const size_t end = std::min(first + kLeast, times.size());
  for (size_t i = first; i < end; ++i)
    if (times[i] > last || (i > first && times[i] <= times[i - 1])) return false;
  return end - first > 1;
}

// How often a time is before the one above it.
size_t StepsBack(const std::vector<double>& times) {
  size_t count = 0;
  for (size_t i = 1; i < times.size(); ++i) count += times[i] < times[i - 1] ? 1 : 0;
  return count;
}

std::vector<Restart> FindRestarts(const std::vector<double>& times) {
  const double step = MedianStep(times);
  std::vector<Restart> restarts;
  double offset = 0, last = times.empty() ? 0 : times.front();
  const auto end_at = [&](size_t i) {
    if (offset != 0) restarts.back().end = i;
    offset = 0;
  };
  for (size_t i = 1; i < times.size(); ++i) {
    if (times[i] > last) end_at(i);  // the clock is right again
    const double time = times[i] + offset;
    if (time <= last && RestartsAt(times, i, last - offset)) {
      const double back = times[i - 1] - times[i];
      end_at(i);
      offset = last + step - times[i];
      restarts.push_back({i, times.size(), back, offset});
    }
    last = std::max(last, times[i] + offset);
  }
  return restarts;
}

}  // namespace

void ContinueTimes(const std::string& path, const std::vector<int>& lines, bool quiet,
                   std::vector<ListedImage>& images) {
  std::vector<double> times;
  for (const ListedImage& image : images) times.push_back(image.timestamp);
  const std::vector<Restart> restarts = FindRestarts(times);
  if (restarts.empty()) return;
  // A clock is set back once in a while. Names that are sorted as text go back every ten images.
  constexpr size_t kLeastStretch = 20;
  if (const size_t back = StepsBack(times);
      back > std::max<size_t>(1, images.size() / kLeastStretch)) {
    if (!quiet)
      Log(LogLevel::kWarning, "{}: its times go back {} times: sort its lines by time (sort -n)",
          path, back);
    return;
  }
  for (const Restart& restart : restarts) {
    if (!quiet)
      Log(LogLevel::kWarning,
          "{}:{}: the time {:.6f} is {:.3f} s before the last one: the clock was set back, or the "
          "recording begins again. {} images from here on get times that go on, {:.6f} s later "
          "than listed; what is matched by time (a ground truth, a gyroscope) does not fit them",
          path, lines[restart.first], images[restart.first].timestamp, restart.back_s,
          restart.end - restart.first, restart.offset_s);
    for (size_t i = restart.first; i < restart.end; ++i) images[i].timestamp += restart.offset_s;
  }
}

}  // namespace oaslam
