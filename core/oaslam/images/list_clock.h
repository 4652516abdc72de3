#pragma once

#include <string>
#include <vector>

#include "oaslam/image_source.h"

namespace oaslam {

// Where times restart, since the clock of a recording was set back or the recording begins again,
// gives the images from there on times that go on, and says so with the line: `lines` has that of
// each image in the file `path`. Where times go back all over, the list is not in the order of
// time: it is left as it is, which a warning says. So are single images out of order.
void ContinueTimes(const std::string& path, const std::vector<int>& lines, bool quiet,
                   std::vector<ListedImage>& images);

}  // namespace oaslam
