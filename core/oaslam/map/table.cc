#include "oaslam/map/table.h"

namespace oaslam {

uint64_t NewTableEpoch() {
  static std::atomic<uint64_t> next{1};
  return next.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace oaslam
