#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>

#include "oaslam/viewer/viewer_session.h"

namespace oaslam {

// Accepts connections and answers them: the page at /, its WebSocket at /ws. It runs on the thread
// of its io_context.
class Server {
 public:
  // Listens at once. Port 0: any that is free. Throws InputError where the address does not belong
  // to this machine or the port is in use.
  Server(boost::asio::io_context& io, const std::string& address, int port,
         std::shared_ptr<ServerState> state);

  int port() const { return acceptor_.local_endpoint().port(); }
  void Start() { Accept(); }
  // Sends the news to every viewer that is ready for it.
  void Broadcast();
  // Whether all viewers have acknowledged everything sent.
  bool AllHaveFollowed() const;
  void Close();

 private:
  void Accept();
  void Serve(boost::asio::ip::tcp::socket socket);

  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  std::shared_ptr<ServerState> state_;
};

}  // namespace oaslam
