#pragma once

#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <string_view>
#include <utility>

#include "oaslam/net/http_connection.h"

namespace oaslam::fuzz {

// Serves one connection whose client sends these bytes and no more, until it ends. It runs on this
// thread; the connection is a pair of sockets, so that no port is used.
inline void Serve(std::shared_ptr<HttpService> service, std::string_view bytes) {
  boost::asio::io_context io(1);
  const auto core = std::make_shared<ServerCore>();
  core->options.patience = std::chrono::milliseconds(200);
  core->service = std::move(service);
  core->host_names = {"localhost"};
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) __builtin_trap();
  // All fits into the socket's buffer (libFuzzer's inputs are short).
  const ssize_t sent = send(ends[1], bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  shutdown(ends[1], SHUT_WR);
  if (sent >= 0) {
    ServeConnection(boost::asio::ip::tcp::socket(io, boost::asio::ip::tcp::v4(), ends[0]), core);
    io.run();
  } else {
    close(ends[0]);
  }
  close(ends[1]);
}

}  // namespace oaslam::fuzz
