#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <stop_token>
#include <vector>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// As WindowBundleAdjustment: map, window, iterations, configuration, request to stop.
using WindowAdjustment = std::function<BundleCorrection(
    const Map&, const std::vector<KeyframeId>&, int, const BundleConfig&, const std::stop_token&)>;

// A bundle adjustment of a copy of the map, on a thread of its own. The destructor stops it and
// waits for its thread.
class BackgroundBundle {
 public:
  // `window`: the keyframes that are adjusted (WindowBundleAdjustment). `frame_index`: the current
  // frame.
  BackgroundBundle(const Map& map, std::vector<KeyframeId> window, const BundleConfig& config,
                   int frame_index, const WindowAdjustment& adjust = WindowBundleAdjustment);
  ~BackgroundBundle() { stop_.request_stop(); }
  BackgroundBundle(const BackgroundBundle&) = delete;
  BackgroundBundle& operator=(const BackgroundBundle&) = delete;

  int begun_at() const { return begun_at_; }
  bool IsReady() const {
    return correction_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  // Waits for the result and applies it to the map, which may have changed since. Rethrows an
  // exception of the bundle adjustment.
  void WaitAndApply(Map& map);

 private:
  int begun_at_;
  Map map_;
  std::vector<KeyframeId> window_;
  std::stop_source stop_;
  std::shared_future<BundleCorrection> correction_;  // last member: its destructor waits
};

}  // namespace oaslam
