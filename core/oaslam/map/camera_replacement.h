#pragma once

#include "oaslam/camera.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The map as if the images of one of its cameras had been taken by `replacement`: key points and
// edges of boxes are mapped back to the original image by the old camera and to the ideal image by
// the new one. Poses, landmarks and objects stay as they are; a bundle adjustment should follow.
// Cameras that differ from the old one in the focal length alone, those of a lens that zooms, are
// replaced in proportion.
// `camera`: index into Map::cameras.
Map WithCamera(const Map& map, int camera, const Camera& replacement);

// The features of an image, converted from the ideal image of one camera to that of another.
Features WithCamera(const Features& features, const Camera& old, const Camera& replacement);

}  // namespace oaslam
