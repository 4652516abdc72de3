#include "mask_choice.h"

#include <spdlog/spdlog.h>

#include <opencv2/imgcodecs.hpp>

#include "camera_choice.h"
#include "oaslam/formats/camera_mask.h"
#include "oaslam/image_source.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/odometry/still_parts.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/util/bad_input.h"
#include "readable_images.h"

namespace oaslam::apps {
namespace {

cv::Mat LoadMask(const std::string& path) {
  const cv::Mat mask = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (mask.empty()) throw BadInput("--mask {}: is no image; allowed: an image, auto or none", path);
  const int visible = cv::countNonZero(mask), all = static_cast<int>(mask.total());
  if (visible == 0) throw BadInput("--mask {}: hides the whole image: black hides", path);
  if (2 * visible < all)
    spdlog::warn("--mask {}: hides {} % of the image: black hides, is it the other way round?",
                 path, int64_t{100} * (all - visible) / all);
  return mask;
}

void CheckSize(const std::string& path, const cv::Mat& mask, const cv::Size& images) {
  if (mask.size() != images)
    throw BadInput("--mask {}: of {}x{} pixels, the images have {}x{}", path, mask.cols, mask.rows,
                   images.width, images.height);
}

cv::Mat HidesNothing(const cv::Size& size) { return cv::Mat(size, CV_8UC1, cv::Scalar(255)); }

// Looks through the first seconds of recorded images. Nothing where they do not tell.
cv::Mat FindMask(ReadableImages& source) {
  StillParts parts;
  std::optional<double> begin_s;
  while (const std::optional<InputImage> image = source.Next()) {
    if (!begin_s) begin_s = image->timestamp;
    if (Interrupted() || parts.IsSettled() || image->timestamp - *begin_s > StillParts::kEnough_s)
      break;
    parts.Add(ViewOf(ToGrey(image->image)), image->timestamp);
  }
  const ImageMask& found = parts.mask();
  if (found.HiddenShare() == 0) return parts.IsSettled() ? HidesNothing(source.size()) : cv::Mat();
  spdlog::warn(
      "a part of the images moves with the camera, and is left out: {} (--mask none: use it; "
      "--mask IMAGE: say which)",
      Describe(found));
  return ImageOf(found, source.size());
}

}  // namespace

void AddMaskOption(CLI::App& app, std::string& mask) {
  app.add_option("--mask", mask,
                 "what moves with the camera (a bonnet, a chassis, an overlay) and is left out: an "
                 "image of the images' size, black there; auto (default): the calibration's, or "
                 "found; none")
      ->type_name("IMAGE|auto|none");
}

cv::Mat MaskFor(const std::string& mask, const std::string& camera, const std::string& images,
                const CommonOptions& common) {
  const bool is_auto = mask.empty() || mask == "auto";
  const std::string path = is_auto ? (IsAutoCamera(camera) ? "" : MaskOfCalibration(camera))
                           : mask == "none" ? ""
                                            : mask;
  const cv::Mat given = path.empty() ? cv::Mat() : LoadMask(path);
  if (images.empty() || IsCamera(images) || common.follow_s || mask == "none") return given;
  ImageSourceOptions range = FrameRange(common);
  range.quiet = true;  // the run that follows opens the same images
  ReadableImages source(OpenImages(images, range), {.says = false});
  if (source.size().empty()) throw source.NoneReadable(images);
  CheckImageSize(source.size(), images);
  if (!given.empty()) {
    CheckSize(path, given, source.size());
    return given;
  }
  return FindMask(source);
}

void EraseHidden(const cv::Mat& mask, std::vector<Detection>& detections) {
  if (!mask.empty()) oaslam::EraseHidden(ImageMask(ViewOf(mask)), mask.size(), detections);
}

void UseMask(const std::string& option, const cv::Mat& mask, Slam& slam, const Camera& camera) {
  if (option == "none")
    slam.SetMask(HidesNothing({camera.width, camera.height}));
  else if (!mask.empty())
    slam.SetMask(mask);
}

}  // namespace oaslam::apps
