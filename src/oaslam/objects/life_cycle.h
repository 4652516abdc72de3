#pragma once

#include <optional>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What decides on the next state of an object.
struct ObjectEvidence {
  bool has_model = false;   // an ellipsoid could be fitted
  double observations = 0;  // total number, converted to a video of 30 Hz
  // Share of its observations whose IoU is at least objects.min_accept_iou.
  double accept_share = 0;
  bool is_forgotten = false;
};

// The index and time of an image.
struct ImageTime {
  int frame = 0;
  double timestamp = 0;  // seconds
};

// The time since an object was last seen.
struct Unseen {
  int images = 0;
  double seconds = 0;
};

// Whether an object that was never mapped is dropped: it takes both a time and a number of images,
// since a slow video has few images.
bool IsForgotten(const Unseen& unseen, const ObjectsConfig& config);
Unseen UnseenSince(const Object& object, const ImageTime& now);

// The share of agreeing observations below which a mapped object is contradicted. It is well below
// the share for acceptance, so that an object does not alternate between the states.
double MinKeptShare(const ObjectsConfig& config);

// The next state: tentative -> initialized with a first model -> mapped after enough agreeing
// observations -> back to initialized when most observations contradict the model. Nothing
// (dropped) for an object that was never mapped and is unseen for too long.
std::optional<ObjectState> NextState(ObjectState state, const ObjectEvidence& evidence,
                                     const ObjectsConfig& config);

}  // namespace oaslam
