#pragma once

#include <memory>
#include <optional>
#include <string>

#include "oaslam/export.h"
#include "oaslam/fork.h"
#include "oaslam/image_source.h"

namespace oaslam {

// Reads a live source on a thread of its own and returns its newest image: a caller that is slower
// than the camera misses images, but never gets an old one:
//
//   const std::unique_ptr<LatestImageSource> camera = OpenCamera("webcam:0");
//   while (const auto image = camera->Next()) slam.Process({image->image, image->timestamp});
class OASLAM_API LatestImageSource : public ImageSource {
 public:
  // Begins to read. Throws InputError without a source.
  explicit LatestImageSource(std::unique_ptr<ImageSource> source);
  // Stops the source, and waits until the present read ends.
  ~LatestImageSource() override;

  // Waits for an image that was not returned yet; returns nothing once the source has ended.
  // Rethrows exceptions of the source.
  std::optional<InputImage> Next() override;
  // The size of the source.
  int size() const override;
  // Ends a waiting Next, and all later ones.
  void Stop() override;
  // The number of images that were replaced by newer ones before they were returned.
  int dropped() const;

 private:
  class Impl;
  ProcessBound<Impl> impl_;
};

// Opens a source whose Next returns the newest image, as an application with a camera needs it. A
// recording is played at its own speed. Unreadable images are left out, with a warning. Throws as
// OpenImages.
OASLAM_API std::unique_ptr<LatestImageSource> OpenCamera(const std::string& source,
                                                         const ImageSourceOptions& options = {});

}  // namespace oaslam
