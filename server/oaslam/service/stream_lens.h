#pragma once

#include <optional>
#include <vector>

#include "oaslam/camera.h"

namespace oaslam {

// The camera of a stream whose lens nobody told, as single images of it tell: the one with the
// median focal length. One view may miss it by ten percent, the median of half a minute by two
// (docs/lab/service.md).
class StreamLens {
 public:
  // Whether a look at the image of this time is worth its while.
  bool IsOpen(double time_s) const;
  // What the image of this time told, if anything.
  void Add(double time_s, const std::optional<Camera>& camera);
  // What is known by now. It changes where that is worth beginning anew with it.
  const std::optional<Camera>& camera() const { return camera_; }

 private:
  std::vector<Camera> seen_;  // by focal length
  int looks_ = 0;             // since the first one told
  double last_s_ = 0;         // the last look
  std::optional<Camera> camera_;
};

}  // namespace oaslam
