#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <string>

namespace oaslam {

// A WebSocket of a server on this machine.
class WebSocketClient {
 public:
  // `protocols`: those that are offered.
  explicit WebSocketClient(unsigned short port, const std::string& protocols = {}) {
    socket_.next_layer().connect({boost::asio::ip::address_v4::loopback(), port});
    socket_.set_option(boost::beast::websocket::stream_base::decorator(
        [&](boost::beast::websocket::request_type& request) {
          if (!protocols.empty()) request.set(kProtocol, protocols);
        }));
    socket_.read_message_max(size_t{1} << 28);
    socket_.handshake(response_, "localhost", "/ws");
  }
  // Only reading shows whether the server has closed the connection.
  void Send(const std::string& message, bool is_text = true) {
    boost::system::error_code ignored;
    socket_.text(is_text);
    socket_.write(boost::asio::buffer(message), ignored);
  }
  // Of a message that does not end with it.
  void SendPart(const std::string& part) { socket_.write_some(false, boost::asio::buffer(part)); }
  std::string Read() {
    boost::beast::flat_buffer buffer;
    socket_.read(buffer);
    return boost::beast::buffers_to_string(buffer.data());
  }
  std::string Ask(const std::string& message, bool is_text = true) {
    Send(message, is_text);
    return Read();
  }
  // Reads until the connection ends; the status that the server closed it with, 0: none came.
  int ReadClose() {
    IsClosed();
    return socket_.reason().code;
  }
  // Reads until the server ends the connection.
  bool IsClosed() {
    boost::beast::flat_buffer buffer;
    boost::system::error_code error;
    while (!error) socket_.read(buffer, error);
    return error != boost::asio::error::timed_out;
  }
  std::string protocol() { return std::string(response_[kProtocol]); }
  bool got_text() const { return socket_.got_text(); }

 private:
  static constexpr auto kProtocol = boost::beast::http::field::sec_websocket_protocol;

  boost::asio::io_context io_;
  boost::beast::websocket::response_type response_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_{io_};
};

}  // namespace oaslam
