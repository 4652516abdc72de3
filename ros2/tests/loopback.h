#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdlib>

namespace oaslam {

// Seconds in which nodes find each other on any machine.
inline constexpr double kLoopbackPatience = 30;

// A domain of this process, on this machine alone.
inline uint32_t LoopbackDomain() {
  constexpr int kDomains = 100;
  setenv("CYCLONEDDS_URI",
         R"(<General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/>)"
         R"(</Interfaces><AllowMulticast>false</AllowMulticast></General>)"
         R"(<Discovery><Peers><Peer address="127.0.0.1"/></Peers>)"
         R"(<ParticipantIndex>auto</ParticipantIndex>)"
         R"(<MaxAutoParticipantIndex>9</MaxAutoParticipantIndex></Discovery>)",
         1);
  return static_cast<uint32_t>(1 + getpid() % kDomains);
}

}  // namespace oaslam
