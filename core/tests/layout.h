#pragma once

#include <cstddef>

#include "oaslam/oaslam.h"

namespace oaslam {

// Static, so that each translation unit has its own; no function, since the linker could take one
// that is compiled for wide vectors for both.
template <class... Types>
static constexpr size_t kSizesAndAlignments[2 * sizeof...(Types)] = {sizeof(Types)...,
                                                                     alignof(Types)...};

// Size and alignment of every public type that holds matrices or rotations, as the including
// translation unit sees them.
static constexpr auto& kLayout = kSizesAndAlignments<
    Rigid3, Ellipsoid, StampedPose, AnchorPose, AnchorRequest, AnchorEdit, ImageInput,
    TrackingResult, RelocalizationResult, RelocalizationResult::Candidate, RelocalizeOptions,
    TrackedPoint, GyroscopeCalibration, ImuSample, ImuCalibration, MapSnapshot::Keyframe,
    MapSnapshot::Landmark, MapSnapshot::Observation, MapSnapshot::Object, SlamState>;

// kLayout of a translation unit that is compiled for the widest vectors.
const size_t* LayoutWithWideVectors();

}  // namespace oaslam
