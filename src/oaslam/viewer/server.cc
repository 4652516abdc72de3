#include "oaslam/viewer/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "oaslam/error.h"
#include "oaslam/viewer/http_session.h"

namespace oaslam {

using boost::asio::ip::tcp;

Server::Server(boost::asio::io_context& io, const std::string& address, int port,
               std::shared_ptr<ServerState> state)
    : acceptor_(io), retry_(io), state_(std::move(state)) {
  boost::system::error_code error;
  const auto ip =
      boost::asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, error);
  if (error)
    throw InputError(
        fmt::format("--bind {}: expected an address, such as 127.0.0.1, 0.0.0.0 or ::1", address));
  if (port < 0 || port > 65535) throw InputError(fmt::format("port {}: allowed: 0 to 65535", port));
  const tcp::endpoint endpoint(ip, static_cast<unsigned short>(port));
  acceptor_.open(endpoint.protocol());
  acceptor_.set_option(tcp::acceptor::reuse_address(true));
  acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(boost::asio::socket_base::max_listen_connections, error);
  if (error)
    throw InputError(
        fmt::format("the viewer cannot listen at {} port {}: {}", address, port, error.message()));
}

void Server::Accept() {
  acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (error == boost::asio::error::operation_aborted || !acceptor_.is_open()) return;
    if (error) {  // no file descriptor is left: try again once other connections have ended
      retry_.expires_after(std::chrono::milliseconds(100));
      retry_.async_wait([this](boost::system::error_code stopped) {
        if (!stopped) Accept();
      });
      return;
    }
    Serve(std::move(socket));
    Accept();
  });
}

void Server::Serve(tcp::socket socket) {
  boost::system::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  if (state_->connections < ServerState::kMaxConnections)
    ServeHttp(std::move(socket), state_);
  else if (state_->refusals < ServerState::kMaxRefusals)
    RefuseConnection(std::move(socket), state_);
}

void Server::Broadcast() {
  for (ViewerSession* viewer : state_->viewers) viewer->SendNews();
}

bool Server::AllHaveFollowed() const {
  return std::ranges::all_of(state_->viewers,
                             [](const ViewerSession* viewer) { return viewer->HasFollowed(); });
}

void Server::Close() {
  boost::system::error_code ignored;
  acceptor_.close(ignored);
  retry_.cancel();
  for (ViewerSession* viewer : state_->viewers)
    viewer->Close(boost::beast::websocket::close_code::going_away);
}

}  // namespace oaslam
