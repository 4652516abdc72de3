#pragma once

#include <cstddef>

#include "oaslam/oaslam.h"

namespace oaslam {

// Size and alignment of every public type that holds matrices or rotations, as the including
// translation unit sees them.
constexpr size_t kLayout[] = {
    sizeof(Rigid3),
    alignof(Rigid3),
    sizeof(Ellipsoid),
    alignof(Ellipsoid),
    sizeof(StampedPose),
    alignof(StampedPose),
    sizeof(AnchorPose),
    alignof(AnchorPose),
    sizeof(AnchorRequest),
    alignof(AnchorRequest),
    sizeof(AnchorEdit),
    alignof(AnchorEdit),
    sizeof(ImageInput),
    alignof(ImageInput),
    sizeof(TrackingResult),
    alignof(TrackingResult),
    sizeof(RelocalizationResult),
    alignof(RelocalizationResult),
    sizeof(RelocalizationResult::Candidate),
    alignof(RelocalizationResult::Candidate),
    sizeof(TrackedPoint),
    alignof(TrackedPoint),
    sizeof(MapSnapshot::Keyframe),
    alignof(MapSnapshot::Keyframe),
    sizeof(MapSnapshot::Landmark),
    alignof(MapSnapshot::Landmark),
    sizeof(MapSnapshot::Observation),
    alignof(MapSnapshot::Observation),
    sizeof(MapSnapshot::Object),
    alignof(MapSnapshot::Object),
    sizeof(SlamState),
    alignof(SlamState),
};

// kLayout of a translation unit that is compiled for the widest vectors.
const size_t* LayoutWithWideVectors();

}  // namespace oaslam
