#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>

#include "oaslam/viewer/viewer_session.h"

namespace oaslam {

// Serves requests on a connection until that becomes a viewer's WebSocket or ends.
void ServeHttp(boost::asio::ip::tcp::socket socket, std::shared_ptr<ServerState> server);

// Answers that there are too many connections, and closes this one.
void RefuseConnection(boost::asio::ip::tcp::socket socket, std::shared_ptr<ServerState> server);

}  // namespace oaslam
