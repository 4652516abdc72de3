#pragma once

#include <memory>
#include <string>

#include "oaslam/service/stream_session.h"

namespace oaslam {

// A camera that makes a new map: the WebSocket /v1/maps/{map}/record.
std::unique_ptr<StreamWork> RecordWork(std::shared_ptr<ServiceState> state, const std::string& map);

}  // namespace oaslam
