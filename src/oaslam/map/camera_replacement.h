#pragma once

#include "oaslam/camera.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The same map as if the images of one of its cameras had been taken for those of another: the
// original pixel of each key point and each edge of a box is what the old camera makes of its place
// in the ideal image, and goes where the new camera has it. Poses, landmarks and objects stay; they
// wait for a bundle adjustment.
// `camera`: index into Map::cameras.
Map WithCamera(const Map& map, int camera, const Camera& replacement);

// The features of an image as another camera has them.
Features WithCamera(const Features& features, const Camera& old, const Camera& replacement);

}  // namespace oaslam
