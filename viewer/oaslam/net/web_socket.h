#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "oaslam/net/request_check.h"
#include "oaslam/net/server_core.h"

namespace oaslam {

// A WebSocket over plain TCP or TLS. It exists until both sides have closed it, or its time is
// over.
template <typename Stream>
class WebSocket : public WebSocketConnection,
                  public Connection,
                  public std::enable_shared_from_this<WebSocket<Stream>> {
 public:
  WebSocket(Stream stream, std::shared_ptr<ServerCore> core,
            std::shared_ptr<WebSocketHandler> handler)
      : socket_(std::move(stream)), core_(std::move(core)), handler_(std::move(handler)) {
    core_->connections.insert(this);
  }
  ~WebSocket() override { core_->connections.erase(this); }

  void Run(RequestHead head) {
    namespace websocket = boost::beast::websocket;
    const websocket::stream_base::timeout times{core_->options.patience, core_->options.patience,
                                                true};
    socket_.set_option(times);
    socket_.read_message_max(handler_->MaxMessage());
    socket_.auto_fragment(false);
    if (OffersOurProtocol(head))
      socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& answer) {
        answer.set(boost::beast::http::field::sec_websocket_protocol, "oaslam");
      }));
    head_ = std::move(head);
    socket_.async_accept(head_, [self = Self()](boost::beast::error_code error) {
      if (error) return;
      self->is_open_ = true;
      self->handler_->OnOpen(self);
      self->Read();
    });
  }

  void Send(std::string message, bool is_text) override {
    outgoing_ = std::move(message);
    is_writing_ = true;
    socket_.text(is_text);
    socket_.async_write(boost::asio::buffer(outgoing_),
                        [self = Self()](boost::beast::error_code error, size_t) {
                          self->is_writing_ = false;
                          if (!error && self->is_open_) self->handler_->OnWritten();
                        });
  }
  bool IsWriting() const override { return is_writing_; }

  void Close(uint16_t status) override {
    if (std::exchange(is_closing_, true)) return;
    socket_.async_close(boost::beast::websocket::close_reason(
                            static_cast<boost::beast::websocket::close_code>(status)),
                        [self = Self()](boost::beast::error_code) {});
    // Where the client does not read, the close waits behind a message that is being written.
    closing_.expires_after(kMostForClose);
    closing_.async_wait([weak = this->weak_from_this()](boost::beast::error_code stopped) {
      if (const auto self = weak.lock(); self && !stopped) self->EndNow();
    });
  }

  void EndSoon() override {
    if (!is_open_) return EndNow();
    Close(boost::beast::websocket::close_code::going_away);
  }
  void EndNow() override { boost::beast::get_lowest_layer(socket_).close(); }

 private:
  // For what is being written and the answer of the client: more than a slow network takes, and
  // not so much that it delays the end of the server.
  static constexpr std::chrono::seconds kMostForClose{2};

  std::shared_ptr<WebSocket> Self() { return this->shared_from_this(); }

  static bool OffersOurProtocol(const RequestHead& head) {
    return boost::beast::http::token_list(head[boost::beast::http::field::sec_websocket_protocol])
        .exists("oaslam");
  }

  void Read() {
    socket_.async_read(buffer_, [self = Self()](boost::beast::error_code error, size_t) {
      if (error) {
        self->is_open_ = false;
        return self->handler_->OnClosed();
      }
      std::string message = boost::beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->handler_->OnMessage(std::move(message), self->socket_.got_text());
      self->Read();
    });
  }

  boost::beast::websocket::stream<Stream> socket_;
  const std::shared_ptr<ServerCore> core_;
  const std::shared_ptr<WebSocketHandler> handler_;
  RequestHead head_;
  boost::beast::flat_buffer buffer_;
  std::string outgoing_;
  bool is_open_ = false, is_writing_ = false, is_closing_ = false;
  boost::asio::steady_timer closing_{socket_.get_executor()};
};

template <typename Stream>
void ServeWebSocket(Stream stream, std::shared_ptr<ServerCore> core,
                    std::shared_ptr<WebSocketHandler> handler, RequestHead head) {
  std::make_shared<WebSocket<Stream>>(std::move(stream), std::move(core), std::move(handler))
      ->Run(std::move(head));
}

}  // namespace oaslam
