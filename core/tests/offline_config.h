#pragma once

#include "oaslam/config.h"

namespace oaslam {

// In sequence a run repeats exactly.
inline SlamConfig OfflineIn(RunnerMode mode = RunnerMode::kSequential) {
  SlamConfig config = SlamConfig::Offline();
  config.runner.mode = mode;
  return config;
}

}  // namespace oaslam
