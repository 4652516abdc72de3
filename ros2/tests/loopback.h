#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdlib>

#include "oaslam/ros2/dds_node.h"

namespace oaslam {

// Seconds in which nodes find each other on any machine.
inline constexpr double kLoopbackPatience = 30;

// A domain of this process, on this machine alone.
inline uint32_t LoopbackDomain() {
  constexpr int kDomains = 100;
  setenv("CYCLONEDDS_URI", kLoopbackOnly, 1);
  return static_cast<uint32_t>(1 + getpid() % kDomains);
}

}  // namespace oaslam
