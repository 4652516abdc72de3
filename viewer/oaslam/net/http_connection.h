#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>

#include "oaslam/net/server_core.h"

namespace oaslam {

// Serves requests on a connection until that becomes a WebSocket or ends; over TLS if the server
// has it.
void ServeConnection(boost::asio::ip::tcp::socket socket, std::shared_ptr<ServerCore> core);

// Answers that there are too many connections, and closes this one.
void RefuseConnection(boost::asio::ip::tcp::socket socket, std::shared_ptr<ServerCore> core);

}  // namespace oaslam
