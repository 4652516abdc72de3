#pragma once

#include <map>
#include <string>

namespace oaslam {

// category_id -> name.
using ClassNames = std::map<int, std::string>;

const ClassNames& CocoClassNames();  // the 80 of COCO, ids 0..79
// YAML "names: {41: cup}" or "names: [a, b]", or a text file with a name a line. Throws InputError.
ClassNames LoadClassNames(const std::string& path);
// The name, or "class 41".
std::string NameOf(const ClassNames& names, int category_id);

}  // namespace oaslam
