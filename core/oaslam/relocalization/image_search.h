#pragma once

#include "oaslam/config.h"
#include "oaslam/image_input.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/relocalization/relocalizer.h"
#include "oaslam/relocalization_result.h"

namespace oaslam {

RelocalizationResult ResultOf(const Relocalization& found);

// Throws InputError where the options contradict each other or the input.
void CheckOptions(const RelocalizeOptions& options, const ImageInput& input);

// The camera that stands for an unknown one, of which only the size is known.
Camera UnknownCamera(const cv::Size& size);

// Find an image in a map, with options that were checked; the result does not name the world of the
// map.
//
// `camera`: that of the image, and of `maker`.
RelocalizationResult FindImage(const ImageInput& input, const Camera& camera,
                               const RelocalizeOptions& options, const Map& map,
                               const SlamConfig& config, FrameMaker& maker,
                               Relocalizer& relocalizer);
// `camera`: that of `maker`, of which the size is used.
RelocalizationResult FindWithUnknownCamera(const ImageInput& input, const Camera& camera,
                                           const RelocalizeOptions& options, const Map& map,
                                           const SlamConfig& config, FrameMaker& maker,
                                           Relocalizer& relocalizer);

}  // namespace oaslam
