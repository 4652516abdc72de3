#pragma once

#include <memory>
#include <string>

#include "oaslam/service/stream_session.h"

namespace oaslam {

// A camera that is followed in a map, which it does not change: the WebSocket
// /v1/maps/{map}/track.
std::unique_ptr<StreamWork> TrackWork(std::shared_ptr<ServiceState> state, const std::string& map,
                                      bool may_write);

}  // namespace oaslam
