#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <string>

#include "message_reader.h"

namespace oaslam {

inline int PortOf(const std::string& url) { return std::stoi(url.substr(url.rfind(':') + 1)); }

inline boost::asio::ip::tcp::socket ConnectTo(boost::asio::io_context& io, const std::string& url) {
  boost::asio::ip::tcp::socket socket(io);
  socket.connect(
      {boost::asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(PortOf(url))});
  return socket;
}

// The whole answer to some bytes, read until the connection ends.
inline std::string AnswerTo(const std::string& url, const std::string& bytes) {
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket = ConnectTo(io, url);
  boost::asio::write(socket, boost::asio::buffer(bytes));
  std::string answer;
  boost::system::error_code error;
  boost::asio::read(socket, boost::asio::dynamic_buffer(answer), error);
  return answer;
}

// A page of a viewer.
class PageClient {
 public:
  // `url`: of the viewer.
  explicit PageClient(const std::string& url) : socket_(ConnectTo(io_, url)) {
    socket_.read_message_max(size_t{1} << 28);
    socket_.handshake("127.0.0.1:" + std::to_string(PortOf(url)), "/ws");
  }
  DecodedMessage Read() {
    boost::beast::flat_buffer buffer;
    socket_.read(buffer);
    return DecodedMessage(boost::beast::buffers_to_string(buffer.data()));
  }
  // Only reading shows whether the server has closed the connection.
  void Send(const std::string& message, bool is_text = true) {
    boost::system::error_code ignored;
    socket_.text(is_text);
    socket_.write(boost::asio::buffer(message), ignored);
  }
  void Acknowledge() { Send(R"({"type":"ack"})"); }
  // The next message of a type; all messages are acknowledged.
  DecodedMessage ReadUntil(const std::string& type) {
    for (;;) {
      DecodedMessage message = Read();
      Acknowledge();
      if (message.header["type"] == type) return message;
    }
  }
  // Reads until the server ends the connection.
  bool IsClosed() {
    boost::beast::flat_buffer buffer;
    boost::system::error_code error;
    while (!error) socket_.read(buffer, error);
    return error != boost::asio::error::timed_out;
  }

 private:
  boost::asio::io_context io_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_;
};

}  // namespace oaslam
