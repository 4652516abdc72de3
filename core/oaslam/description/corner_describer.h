#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "oaslam/description/descriptor_weights.h"
#include "oaslam/features/features.h"
#include "oaslam/features/grey_image.h"

namespace oaslam {

// Where a corner of a pyramid lies in the image that the pyramid was made of.
struct ScaledCorner {
  Eigen::Vector2f px = Eigen::Vector2f::Zero();  // integers at the centres of pixels
  float scale = 1;  // size of a pixel of the corner's level, in pixels of the image; above 0
};

// Computes learned descriptors of corners by the network of train/, from the image or from a copy
// scaled down by 2 or 4, whichever is nearest to the corner's scale. The descriptors are not
// invariant to rotation; the image is never rotated. Not thread-safe: it has buffers. OpenCV runs
// the convolutions on as many threads as cv::setNumThreads allows; the number of threads does not
// change a descriptor. Another processor or version of OpenCV may round a value the other way.
class CornerDescriber {
 public:
  // `weights`: the bytes of a file that train/export.py wrote, by default those built into the
  // program; they are not needed afterwards. Throws InputError where the bytes are of another file,
  // or damaged.
  explicit CornerDescriber(std::string_view weights = DescriptorWeights());
  ~CornerDescriber();
  CornerDescriber(CornerDescriber&&) noexcept;
  CornerDescriber& operator=(CornerDescriber&&) noexcept;

  // The descriptors of corners, in their order. The image has any size but 0; a corner outside of
  // it is described at its border. Takes as long for one corner as for many: about a millisecond
  // for 10,000 pixels. Throws std::bad_alloc where memory is short.
  std::vector<Descriptor> Describe(const GreyImage& image, std::span<const ScaledCorner> corners);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace oaslam
