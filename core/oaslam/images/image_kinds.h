#pragma once

#include <string>
#include <vector>

namespace oaslam {

// Leaves out names of depth images, masks and the like of other images of the folder, whose names
// have the same numbers; says so, unless `quiet`.
void LeaveOutOtherKinds(const std::string& folder, bool quiet, std::vector<std::string>& names);

// Says where the names are of several series with the same numbers, such as left_1.png and
// right_1.png: of two cameras, which no film is.
void WarnOfSeries(const std::string& folder, const std::vector<std::string>& names);

}  // namespace oaslam
