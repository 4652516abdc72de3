#pragma once

#include <memory>
#include <string>

#include "oaslam/image_source.h"
#include "oaslam/images/dataset.h"

namespace oaslam {

// The images of a video file, upright, with the times that are listed for it, if these are as many
// as its images, else with those in its container, relative to the first image. Where these are not
// usable, it warns and uses the file's rate. Throws InputError as
// OpenImages; so does Next, where no image at all can be decoded.
std::unique_ptr<ImageSource> OpenVideo(const FilmSource& film, const ImageSourceOptions& options);

// The name of an image of a video or a camera: "000012" of index 12.
std::string NameOfVideoImage(int index);

}  // namespace oaslam
