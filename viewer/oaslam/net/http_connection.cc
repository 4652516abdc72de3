#include "oaslam/net/http_connection.h"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <cstdio>
#include <exception>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "oaslam/net/request_check.h"
#include "oaslam/net/web_socket.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using TlsStream = asio::ssl::stream<beast::tcp_stream>;

constexpr uint32_t kMaxHeader = 8192;  // bytes, as most servers allow

template <typename Stream>
class HttpConnection : public Connection,
                       public std::enable_shared_from_this<HttpConnection<Stream>> {
 public:
  HttpConnection(Stream stream, std::shared_ptr<ServerCore> core)
      : stream_(std::move(stream)), core_(std::move(core)) {
    boost::system::error_code error;
    const auto peer = beast::get_lowest_layer(stream_).socket().remote_endpoint(error);
    is_local_ = !error && peer.address().is_loopback();
    address_ = error ? "" : peer.address().to_string();
    core_->connections.insert(this);
  }
  ~HttpConnection() override {
    EndBody();
    core_->connections.erase(this);
    RemoveUnownedFile();
  }

  void Start() {
    if constexpr (std::is_same_v<Stream, TlsStream>) {
      idle_.Enter(core_->idle, this);
      Limit(core_->options.patience);
      stream_.async_handshake(asio::ssl::stream_base::server,
                              [self = Self()](beast::error_code error) {
                                self->idle_.Leave();
                                if (!error) self->Read();
                              });
    } else {
      Read();
    }
  }

  void EndSoon() override {
    if (idle_) EndNow();
  }
  void EndNow() override { beast::get_lowest_layer(stream_).close(); }

 private:
  using StringResponse = http::response<http::string_body>;

  std::shared_ptr<HttpConnection> Self() { return this->shared_from_this(); }
  void Limit(std::chrono::milliseconds time) {
    beast::get_lowest_layer(stream_).expires_after(time);
  }

  void Read() {
    if (core_->is_draining) return End();
    head_.emplace();
    head_->header_limit(kMaxHeader);
    // The service decides, once the header is known. (No limit, as boost::none, refuses all bodies
    // in Boost 1.74.)
    head_->body_limit(std::numeric_limits<uint64_t>::max());
    idle_.Enter(core_->idle, this);
    Limit(core_->options.patience);
    http::async_read_header(stream_, buffer_, *head_,
                            [self = Self()](beast::error_code error, size_t) {
                              self->idle_.Leave();
                              self->OnHeader(error);
                            });
  }

  void EndBody() {
    receiving_.Leave();
    core_->body_bytes -= std::exchange(body_bytes_, 0);
  }

  void OnHeader(beast::error_code error) {
    if (error == http::error::end_of_stream || error == asio::error::operation_aborted)
      return End();
    keeps_alive_ = false;
    if (error == beast::error::timeout) return End();
    if (error == http::error::header_limit)
      return Answer(
          TextAnswer(http::status::request_header_fields_too_large, "the header is too large\n"));
    if (error) return Answer(TextAnswer(http::status::bad_request, "bad request\n"));
    version_ = head_->get().version();
    std::optional<HttpRequest> request = RequestOf(head_->get(), address_, is_local_);
    if (!request) return Answer(TextAnswer(http::status::bad_request, "bad request\n"));
    is_head_ = request->method == http::verb::head;
    request_ = std::move(*request);
    Guarded([this] {
      std::optional<HttpAnswer> refusal = CheckRequest(*core_, request_);
      if (!refusal) refusal = CheckCoding(request_.fields);
      if (refusal) return Answer(std::move(*refusal));
      if (beast::websocket::is_upgrade(head_->get())) return Upgrade();
      ReadBody();
    });
  }

  void Upgrade() {
    std::shared_ptr<WebSocketHandler> handler = core_->service->Upgrade(request_);
    if (!handler)
      return Answer(TextAnswer(http::status::not_found, "there is no WebSocket here\n"));
    beast::get_lowest_layer(stream_).expires_never();
    ServeWebSocket(std::move(stream_), core_, std::move(handler), head_->release());
  }

  void ReadBody() {
    const HttpService::BodyPlan plan = core_->service->PlanBody(request_);
    if (head_->content_length() && *head_->content_length() > plan.limit)
      return Answer(TooLarge(plan.limit));
    // A chunked body has no length in advance: it is counted as the largest.
    const uint64_t bytes = head_->content_length() ? *head_->content_length()
                           : head_->chunked()      ? plan.limit
                                                   : 0;
    if (plan.file.empty()) {
      if (bytes > 0 && core_->body_bytes + bytes > core_->options.max_body_bytes) {
        HttpAnswer answer =
            TextAnswer(http::status::service_unavailable, "too many bodies at once\n");
        answer.fields.emplace_back("Retry-After", "1");
        return Answer(std::move(answer));
      }
      body_bytes_ = bytes;
      core_->body_bytes += bytes;
    }
    if (bytes > 0) receiving_.Enter(core_->receiving, this);
    keeps_alive_ = head_->keep_alive();
    Limit(core_->TimeFor(bytes));
    if (beast::iequals(request_.fields[http::field::expect], "100-continue")) return Continue(plan);
    ReceiveBody(plan);
  }

  // curl waits for this before it sends a large body.
  void Continue(const HttpService::BodyPlan& plan) {
    const auto answer =
        std::make_shared<http::response<http::empty_body>>(http::status::continue_, version_);
    http::async_write(stream_, *answer,
                      [self = Self(), answer, plan](beast::error_code error, size_t) {
                        if (!error) self->ReceiveBody(plan);
                      });
  }

  void ReceiveBody(const HttpService::BodyPlan& plan) {
    if (plan.file.empty()) {
      auto parser = std::make_shared<http::request_parser<http::string_body>>(std::move(*head_));
      return Receive(parser, plan);
    }
    auto parser = std::make_shared<http::request_parser<http::file_body>>(std::move(*head_));
    beast::error_code error;
    parser->get().body().open(plan.file.c_str(), beast::file_mode::write_new, error);
    if (error) {
      Log(LogLevel::kWarning, plan.file + ": " + error.message());
      keeps_alive_ = false;
      return Answer(TextAnswer(http::status::internal_server_error, "no place for the body\n"));
    }
    unowned_file_ = plan.file;
    Receive(parser, plan);
  }

  template <typename Parser>
  void Receive(std::shared_ptr<Parser> parser, const HttpService::BodyPlan& plan) {
    parser->body_limit(plan.limit);
    http::async_read(
        stream_, buffer_, *parser,
        [self = Self(), parser, limit = plan.limit](beast::error_code error, size_t) {
          self->receiving_.Leave();
          if (error) return self->RefuseBody(error, limit);
          if constexpr (std::is_same_v<typename Parser::value_type::body_type, http::file_body>) {
            parser->get().body().close();
            self->request_.body_file = std::exchange(self->unowned_file_, "");
          } else {
            self->request_.body = std::move(parser->get().body());
          }
          self->Handle();
        });
  }

  void RefuseBody(beast::error_code error, uint64_t limit) {
    keeps_alive_ = false;
    if (error == http::error::body_limit) return Answer(TooLarge(limit));
    if (error == beast::error::timeout || error == asio::error::operation_aborted) return End();
    Answer(TextAnswer(http::status::bad_request, "bad request\n"));
  }

  HttpAnswer TooLarge(uint64_t limit) {
    return TextAnswer(http::status::payload_too_large,
                      "the body is too large, allowed: " + std::to_string(limit) + " bytes\n");
  }

  void Handle() {
    beast::get_lowest_layer(stream_).expires_never();  // the service takes the time that it needs
    // The reply gives its reference to the connection away with the answer. So a service that keeps
    // the reply does not keep the connection, and the connection is destroyed on the server's
    // thread.
    const auto waiting = std::make_shared<std::shared_ptr<HttpConnection>>(Self());
    Guarded([&] {
      core_->service->Handle(std::move(request_), [waiting, executor = stream_.get_executor()](
                                                      HttpAnswer answer) {
        asio::post(executor, [self = std::move(*waiting), answer = std::move(answer)]() mutable {
          self->Answer(std::move(answer));
        });
      });
    });
  }

  // An error of the service is the answer, and does not end the server.
  template <typename Act>
  void Guarded(Act&& act) {
    try {
      act();
    } catch (const std::exception& error) {
      Log(LogLevel::kWarning, core_->options.what + ": " + error.what());
      keeps_alive_ = false;
      Answer(TextAnswer(http::status::internal_server_error, "internal error\n"));
    }
  }

  void Answer(HttpAnswer answer) {
    EndBody();
    RemoveUnownedFile();
    if (!answer.file.empty()) return AnswerFile(answer);
    StringResponse response(answer.status, version_);
    SetFields(answer, response);
    response.body() = std::move(answer.body);
    response.prepare_payload();
    if (is_head_) response.body().clear();  // the content length stays in the header
    Write(std::move(response));
  }

  // A file is streamed from the disk, however large it is.
  void AnswerFile(const HttpAnswer& answer) {
    http::file_body::value_type file;
    beast::error_code error;
    file.open(answer.file.c_str(), beast::file_mode::scan, error);
    if (error)  // it was deleted meanwhile
      return Answer(TextAnswer(http::status::not_found, "not found\n"));
    if (is_head_) {
      StringResponse response(answer.status, version_);
      SetFields(answer, response);
      response.content_length(file.size());
      return Write(std::move(response));
    }
    http::response<http::file_body> response(answer.status, version_);
    SetFields(answer, response);
    response.body() = std::move(file);
    response.prepare_payload();
    Write(std::move(response));
  }

  template <typename Message>
  void Write(Message response) {
    response.keep_alive(keeps_alive_ && !core_->is_draining);
    const auto kept = std::make_shared<Message>(std::move(response));
    const auto length = kept->payload_size();
    Limit(core_->TimeFor(length ? *length : 0));
    http::async_write(stream_, *kept, [self = Self(), kept](beast::error_code error, size_t) {
      if (error || kept->need_eof() || !kept->keep_alive()) return self->End();
      self->Read();
    });
  }

  // What the client still sends is read for a moment: to close a socket with unread bytes resets
  // the connection, and the client could lose the answer.
  void End() {
    constexpr auto kMoment = std::chrono::seconds(2);  // a round trip and the rest of a body
    Limit(kMoment);
    if constexpr (std::is_same_v<Stream, TlsStream>) {
      stream_.async_shutdown([self = Self()](beast::error_code) {});
    } else {
      beast::error_code ignored;
      stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      Drain(0);
    }
  }

  void Drain(size_t read) {
    constexpr size_t kMost = 1 << 20;  // bytes; more than buffers on the way hold
    stream_.async_read_some(asio::buffer(rest_),
                            [self = Self(), read](beast::error_code error, size_t count) {
                              if (!error && read + count < kMost) self->Drain(read + count);
                            });
  }

  void RemoveUnownedFile() {
    if (!unowned_file_.empty()) std::remove(std::exchange(unowned_file_, "").c_str());
  }

  Stream stream_;
  const std::shared_ptr<ServerCore> core_;
  std::string address_;
  bool is_local_ = false;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> head_;
  HttpRequest request_;
  unsigned version_ = 11;
  bool keeps_alive_ = false, is_head_ = false;
  std::string unowned_file_;    // with the body of a request that the service has not got yet
  ListPlace idle_, receiving_;  // in the lists of the core
  uint64_t body_bytes_ = 0;     // its part of ServerCore::body_bytes
  std::array<char, 4096> rest_{};
};

// Answers 503 to a connection too many, and reads what the client sends before it closes (as
// HttpConnection::End).
class Refusing : public std::enable_shared_from_this<Refusing> {
 public:
  Refusing(tcp::socket socket, std::shared_ptr<ServerCore> core)
      : stream_(std::move(socket)), core_(std::move(core)) {
    ++core_->refusals;
  }
  ~Refusing() { --core_->refusals; }

  void Run() {
    static constexpr std::string_view kAnswer =
        "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Type: "
        "text/plain\r\nRetry-After: 1\r\nContent-Length: 21\r\n\r\ntoo many connections\n";
    stream_.expires_after(std::chrono::seconds(2));
    if (core_->tls) return;  // an answer would need a handshake first
    asio::async_write(stream_, asio::buffer(kAnswer.data(), kAnswer.size()),
                      [self = shared_from_this()](beast::error_code error, size_t) {
                        if (error) return;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, error);
                        self->Drain();
                      });
  }

 private:
  void Drain() {
    stream_.async_read_some(asio::buffer(rest_),
                            [self = shared_from_this()](beast::error_code error, size_t count) {
                              if (error || (self->read_ += count) > 65536) return;
                              self->Drain();
                            });
  }

  beast::tcp_stream stream_;
  const std::shared_ptr<ServerCore> core_;
  std::array<char, 1024> rest_{};
  size_t read_ = 0;
};

}  // namespace

void ServeConnection(tcp::socket socket, std::shared_ptr<ServerCore> core) {
  beast::tcp_stream stream(std::move(socket));
  if (core->tls) {
    TlsStream tls(std::move(stream), *core->tls);
    std::make_shared<HttpConnection<TlsStream>>(std::move(tls), std::move(core))->Start();
  } else {
    std::make_shared<HttpConnection<beast::tcp_stream>>(std::move(stream), std::move(core))
        ->Start();
  }
}

void RefuseConnection(tcp::socket socket, std::shared_ptr<ServerCore> core) {
  std::make_shared<Refusing>(std::move(socket), std::move(core))->Run();
}

}  // namespace oaslam
