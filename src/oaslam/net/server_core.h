#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "oaslam/net/http_server.h"
#include "oaslam/net/http_service.h"
#include "oaslam/net/tokens.h"

namespace oaslam {

// A connection of any kind, as the server sees it.
class Connection {
 public:
  virtual ~Connection() = default;
  // Ends it if it waits for a request; else once its answer is written. A WebSocket is closed.
  virtual void EndSoon() = 0;
  virtual void EndNow() = 0;
};

// What the connections of one server share. Used on its thread only.
struct ServerCore {
  ServerOptions options;
  std::shared_ptr<HttpService> service;
  std::optional<Tokens> tokens;
  std::unique_ptr<boost::asio::ssl::context> tls;
  std::vector<std::string> host_names;
  std::set<Connection*> connections;
  std::list<Connection*> idle;       // those that wait for a request, longest first
  std::list<Connection*> receiving;  // those that send a body, longest first
  uint64_t body_bytes = 0;           // of memory for bodies that come, or wait for their answer
  int refusals = 0;                  // connections that are being refused
  bool is_draining = false;

  // How long `bytes` may take.
  std::chrono::milliseconds TimeFor(uint64_t bytes) const {
    return options.patience + std::chrono::milliseconds(1000 * bytes / options.least_rate);
  }
};

}  // namespace oaslam
