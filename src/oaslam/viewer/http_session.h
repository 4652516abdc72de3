#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>

#include "oaslam/viewer/viewer_session.h"

namespace oaslam {

// Serves requests on a connection until it becomes a viewer's WebSocket or ends.
void ServeHttp(boost::asio::ip::tcp::socket socket, std::shared_ptr<ServerState> server);

// Tells one too many that there are too many.
void RefuseConnection(boost::asio::ip::tcp::socket socket, std::shared_ptr<ServerState> server);

}  // namespace oaslam
