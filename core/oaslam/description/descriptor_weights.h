#pragma once

#include <string_view>

namespace oaslam {

// data/descriptor/v1.bin, which is part of the program; see train/export.py for its layout.
std::string_view DescriptorWeights();

}  // namespace oaslam
