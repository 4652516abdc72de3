#include <Eigen/Geometry>

#include "layout.h"

namespace oaslam {

#ifdef __AVX512F__
// Else the comparison would show nothing.
static_assert(alignof(Eigen::Quaterniond) > 16);
#endif

const size_t* LayoutWithWideVectors() { return kLayout; }

}  // namespace oaslam
