#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/class_relations.h"
#include "oaslam/config.h"
#include "oaslam/features/grey_image.h"
#include "oaslam/features/orb_extractor.h"
#include "oaslam/image_input.h"
#include "oaslam/map/frame.h"

namespace oaslam {

// Returns a grey image as it is, and converts a BGR or BGRA image. Throws InputError for any other
// type.
cv::Mat ToGrey(const cv::Mat& image);
// The pixels of a grey image, which must outlive the view.
GreyImage ViewOf(const cv::Mat& grey);

// A mask as an image: 0 where it hides, else 255.
cv::Mat ImageOf(const ImageMask& mask, const cv::Size& size);

// Removes the boxes, in pixels of images of this size, of which a mask hides more than half: such
// boxes show what moves with the camera.
void EraseHidden(const ImageMask& mask, const cv::Size& size, std::vector<Detection>& detections);

// Check the inputs of Slam; throw InputError.
void CheckConfig(const SlamConfig& config);
void CheckCamera(const Camera& camera);
void CheckMode(RelocalizationMode mode);
void CheckPose(const std::optional<Rigid3>& pose);
void CheckGravity(const std::optional<Eigen::Vector3d>& gravity_in_cam);
// `image_s`: the time stamp of the image that the samples come with.
void CheckAngularVelocity(const std::vector<AngularVelocity>& samples, double image_s);

// IdealDetections of checked boxes; throws InputError for an invalid one.
std::vector<ObjectDetection> CheckedDetections(const Camera& camera,
                                               const std::vector<Detection>& detections);

// Makes frames of images: checks the input and extracts features, unless they are given.
class FrameMaker {
 public:
  FrameMaker(const SlamConfig& config, const Camera& camera)
      : given_(camera),
        camera_(std::make_shared<const Camera>(camera)),
        min_score_(config.relocalization.min_score),
        has_learned_(config.features.descriptor == DescriptorKind::kLearnedAndOrb),
        extractor_(config.features, camera),
        nothing_(std::make_shared<const Features>(extractor_.Nothing())) {}

  // From now on extracts key points only outside of what the mask hides.
  void SetMask(const ImageMask& mask) { extractor_.SetMask(mask); }

  // From now on the lens has `ratio` times the focal length of the camera that was given, known up
  // to `sigma`, the standard deviation of its logarithm. Ratios are rounded to half a thousandth,
  // so that similar images share a camera. Returns whether the camera of the next image is another
  // one than that of the last.
  bool UseFocalRatio(double ratio, double sigma);

  // Throws InputError for an image of another size or type, for detections or samples of a
  // gyroscope that are not valid, and for gravity that is zero or not finite.
  void Check(const ImageInput& input) const;

  // The frame of an image, with about `keypoints` key points, none inside the boxes of objects that
  // can move according to `classes`. Throws as Check.
  Frame Make(const ImageInput& input, int index, int keypoints, const ClassRelations& classes);
  // Makes the frame of a valid image without key points, which takes no time.
  Frame MakeWithoutFeatures(const ImageInput& input, int index) const;
  const std::shared_ptr<const Camera>& camera() const { return camera_; }

 private:
  std::vector<Box> MovingBoxes(const Frame& frame, const ClassRelations& classes) const;
  Features ExtractStatic(const GreyImage& grey, int count, const std::vector<Box>& moving);

  Camera given_;
  std::shared_ptr<const Camera> camera_;  // with the present focal length
  int focal_steps_ = 0;                   // from that of the camera that was given
  double min_score_;                      // of a detection inside of which key points are dropped
  bool has_learned_;                      // frames keep their image
  OrbExtractor extractor_;
  std::shared_ptr<const Features> nothing_;
};

}  // namespace oaslam
