#pragma once

#include <optional>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What decides over an object's life.
struct ObjectEvidence {
  bool has_model = false;   // an ellipsoid could be fitted
  double observations = 0;  // in all, as of a video of 30 Hz
  double accept_share = 0;  // of its observations with at least objects.min_accept_iou
  bool is_forgotten = false;
};

// Which image it is, and when.
struct ImageTime {
  int frame = 0;
  double timestamp = 0;  // seconds
};

// Since something was last seen.
struct Unseen {
  int images = 0;
  double seconds = 0;
};

// Whether what was never mapped is dropped: both a time and some images, for a slow video has few.
bool IsForgotten(const Unseen& unseen, const ObjectsConfig& config);
Unseen UnseenSince(const Object& object, const ImageTime& now);

// The share of agreeing observations below which an object is contradicted: well below the one that
// admits it, so that it does not flicker.
double MinKeptShare(const ObjectsConfig& config);

// Tentative -> Initialized with a first model -> Mapped when seen often enough and in agreement ->
// back to Initialized when most observations contradict the model. Dropped (nothing) when unseen
// for too long without ever having been mapped.
std::optional<ObjectState> NextState(ObjectState state, const ObjectEvidence& evidence,
                                     const ObjectsConfig& config);

}  // namespace oaslam
