#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/image_source.h"

namespace oaslam {

// All images of a folder, a dataset or a list file, in their order and with their times; nothing
// where the source is a video or a recording of ROS. A folder is in the natural order of its names,
// or, if they are times, in the order of these. Throws InputError where there is no such source,
// where it is no plain file, and where a line of a list or the unit of the times is not understood.
std::optional<std::vector<ListedImage>> ListAll(const std::string& source,
                                                const ImageSourceOptions& options);

// ReadList returns the images of a list file; ListFolder those of a folder whose names without
// extension end in `end`. Both order them as ListAll does.
std::vector<ListedImage> ReadList(const std::string& path, const ImageSourceOptions& options);
std::vector<ListedImage> ListFolder(const std::string& folder, const ImageSourceOptions& options,
                                    const std::string& end = "");
// Sets the times of images. Where their names are times, sorts the images by these and uses them;
// without such names, or with options.fps, the times follow from the rate. Logs that names are
// taken as times. Returns whether the times are those of the names.
bool SetTimes(const std::string& source, const ImageSourceOptions& options,
              std::vector<ListedImage>& images);

// All images of a source with their times, whatever the range in the options; of a video or a
// recording of ROS with their names for paths. None where they are not known before they are read.
// Throws InputError.
std::vector<ListedImage> TimesOfImages(const std::string& source,
                                       const ImageSourceOptions& options);

// The names of all images of a source, with their paths where each is a file, whatever the range in
// the options; none where they are not known before they come. Throws InputError.
std::vector<std::string> NamesOfImages(const std::string& source,
                                       const ImageSourceOptions& options);

}  // namespace oaslam
