#pragma once

#include <optional>

#include "oaslam/config.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What decides on the next state of an object.
struct ObjectEvidence {
  bool has_model = false;   // an ellipsoid could be fitted
  double observations = 0;  // in all, as of a video of 30 Hz
  ViewOverlap overlap;      // of the ellipsoid with its observations, by objects.min_accept_iou
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

// Whether the observations agree well enough with their ellipsoid for an object of the map: the
// share objects.min_accept_share of them overlaps by objects.min_accept_iou, and so does their
// mean. The mean is of whole boxes, where there are any: a box that the image's border cuts agrees
// with almost any ellipsoid that reaches beyond the border.
bool IsConfirmed(const ViewOverlap& overlap, const ObjectsConfig& config);
// Whether so many of them disagree that the ellipsoid is wrong: a share well below the one that
// admits an object, so that objects do not flicker.
bool IsContradicted(const ViewOverlap& overlap, const ObjectsConfig& config);

// Tentative -> Initialized with a first model -> Mapped when seen often enough and in agreement ->
// back to Initialized when the observations contradict the model, or their mean overlap is no
// longer objects.min_accept_iou. Dropped (nothing) when unseen
// for too long without ever having been mapped.
std::optional<ObjectState> NextState(ObjectState state, const ObjectEvidence& evidence,
                                     const ObjectsConfig& config);

}  // namespace oaslam
