#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
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

// A connection's place in a list, at the end; left at the latest when this ends.
class ListPlace {
 public:
  ListPlace() = default;
  ~ListPlace() { Leave(); }
  ListPlace(const ListPlace&) = delete;
  ListPlace& operator=(const ListPlace&) = delete;

  void Enter(std::list<Connection*>& list, Connection* connection) {
    Leave();
    at_ = list.insert(list.end(), connection);
    list_ = &list;
  }
  void Leave() {
    if (list_) std::exchange(list_, nullptr)->erase(at_);
  }
  explicit operator bool() const { return list_ != nullptr; }

 private:
  std::list<Connection*>* list_ = nullptr;
  std::list<Connection*>::iterator at_;
};

// What the connections of one server share. Used on its thread only.
struct ServerCore {
  ServerOptions options;
  std::shared_ptr<HttpService> service;
  std::optional<Tokens> tokens;
  std::unique_ptr<boost::asio::ssl::context> tls;
  std::vector<std::string> host_names;
  std::set<Connection*> connections;
  std::list<Connection*> idle;       // those that wait for a request or shake hands, longest first
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
