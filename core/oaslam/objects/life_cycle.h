#pragma once

#include <optional>

#include "oaslam/config.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/object_model.h"

namespace oaslam {

struct ObjectEvidence {
  bool has_model = false;   // an ellipsoid could be fitted
  double observations = 0;  // total number, converted to a video of 30 Hz
  ViewOverlap overlap;      // of the ellipsoid with its observations, by kMinAcceptIoU
  bool is_forgotten = false;
  double surfaces = 0;  // of the observations, with the depth of the surface
};

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
bool IsForgotten(const Unseen& unseen);
Unseen UnseenSince(const Object& object, const ImageTime& now);

// Whether the observations agree with the ellipsoid well enough for an object of the map: at least
// the share objects.min_accept_share of them, and their mean, overlap the ellipsoid by
// kMinAcceptIoU. The mean is over boxes that the image border does not cut, where there are any,
// since cut boxes agree with almost any ellipsoid that reaches beyond the border.
bool IsConfirmed(const ViewOverlap& overlap, const ObjectsConfig& config);
// Whether so many observations disagree with the ellipsoid that it is wrong. The share is well
// below that for acceptance, so that an object does not alternate between the states.
bool IsContradicted(const ViewOverlap& overlap, const ObjectsConfig& config);

// The next state: tentative -> initialized with a first model -> mapped after enough agreeing
// observations -> back to initialized when there is no model, too many observations contradict it
// (IsContradicted), or their mean overlap is below kMinAcceptIoU. Nothing (dropped) for an object
// that was never mapped and is unseen for too long.
std::optional<ObjectState> NextState(ObjectState state, const ObjectEvidence& evidence,
                                     const ObjectsConfig& config);

}  // namespace oaslam
