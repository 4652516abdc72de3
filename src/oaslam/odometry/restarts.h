#pragma once

#include "oaslam/odometry/window.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct RestartReport {
  int tried = 0;
  bool is_changed = false;
};

// Looks for a better minimum of a window: its newest part, from the first or the middle free image
// on, begins anew with the velocity before it, with a rotation alone, and with the motions of the
// homography of its first and last image; each is optimised with all sightings, also those that the
// present solution holds to be outliers, since a wrong solution hides its own evidence. Takes the
// cheapest if it is clearly better.
RestartReport RestartWindow(const WindowOptions& options, Rng& rng, Window& window);

}  // namespace oaslam
