#include "oaslam/viewer/http_session.h"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <optional>
#include <type_traits>
#include <utility>

#include "oaslam/net/host_policy.h"
#include "oaslam/viewer/page.h"

namespace oaslam {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Response = http::response<http::string_body>;
using FileResponse = http::response<http::file_body>;

constexpr auto kTimeout = std::chrono::seconds(10);
constexpr auto kFileTimeout = std::chrono::seconds(120);  // for files of some tens of megabytes
constexpr std::string_view kModels = "/models/";

// The page is self-contained: it may load nothing from elsewhere, and no other page may frame it.
constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src blob: "
    "data:; connect-src "
    "'self' blob: data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

// Increments a counter as long as the returned token exists.
std::shared_ptr<void> Counted(int& count, std::shared_ptr<ServerState> server) {
  ++count;
  return {&count, [server = std::move(server)](int* counter) { --*counter; }};
}

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, std::shared_ptr<ServerState> server)
      : stream_(std::move(socket)),
        server_(std::move(server)),
        token_(Counted(server_->connections, server_)) {}

  void Read() {
    constexpr uint32_t kMaxHeader = 8192;  // bytes
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    stream_.expires_after(kTimeout);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](beast::error_code error, size_t) { self->OnRequest(error); });
  }

 private:
  void OnRequest(beast::error_code error) {
    if (error == http::error::end_of_stream || error == beast::error::timeout ||
        error == asio::error::operation_aborted)
      return End();
    if (error) return Answer(Text(http::status::bad_request, "bad request\n", 11, false));
    const auto& request = parser_->get();
    const std::string host(request[http::field::host]), origin(request[http::field::origin]);
    if (!IsAllowedHost(host, {server_->machine_name}))
      return Answer(Text(http::status::forbidden,
                         "unknown host name: use an address or localhost\n", request.version(),
                         false));
    if (!IsAllowedOrigin(origin, host))
      return Answer(Text(http::status::forbidden, "foreign origin\n", request.version(), false));
    const std::string target(request.target().substr(0, request.target().find('?')));
    if (target == "/ws" && beast::websocket::is_upgrade(request)) {
      stream_.expires_never();
      std::make_shared<ViewerSession>(std::move(stream_), server_, token_)->Run(parser_->release());
      return;
    }
    const bool keep = request.keep_alive();
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return Answer(
          Text(http::status::method_not_allowed, "only GET and HEAD\n", request.version(), false));
    if (target.starts_with(kModels)) return AnswerModel(target.substr(kModels.size()), request);
    if (target != "/")
      return Answer(Text(http::status::not_found, "not found\n", request.version(), keep));
    Response response = Text(http::status::ok, std::string(ViewerPage()), request.version(), keep);
    response.set(http::field::content_type, "text/html; charset=utf-8");
    if (request.method() == http::verb::head)
      response.body().clear();  // the content length stays in the header
    Answer(std::move(response));
  }

  // Answers with a file of a model of virtual content, or one that it refers to. A user's file is
  // streamed from the disk, however large it is.
  void AnswerModel(const std::string& path, const http::request<http::empty_body>& request) {
    const auto not_found = [&] {
      Answer(Text(http::status::not_found, "not found\n", request.version(), request.keep_alive()));
    };
    const auto found = server_->models ? server_->models->Find(path) : std::nullopt;
    if (!found) return not_found();
    const bool is_head = request.method() == http::verb::head;
    if (found->path.empty()) {
      Response response = Text(http::status::ok, std::string(found->bytes), request.version(),
                               request.keep_alive());
      response.set(http::field::content_type, found->content_type);
      if (is_head) response.body().clear();
      return Answer(std::move(response));
    }
    http::file_body::value_type file;
    beast::error_code error;
    file.open(found->path.c_str(), beast::file_mode::scan, error);
    if (error) return not_found();  // it was deleted meanwhile
    if (is_head) {
      Response response = Text(http::status::ok, "", request.version(), request.keep_alive());
      response.set(http::field::content_type, found->content_type);
      response.content_length(file.size());
      return Answer(std::move(response));
    }
    FileResponse response(http::status::ok, request.version());
    SetFields(response, found->content_type, request.keep_alive());
    response.body() = std::move(file);
    response.prepare_payload();
    Answer(std::move(response));
  }

  template <typename Message>
  static void SetFields(Message& response, const std::string& content_type, bool keep_alive) {
    response.set(http::field::content_type, content_type);
    response.set(http::field::cache_control, "no-store");
    response.set(http::field::x_frame_options, "DENY");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Content-Security-Policy", kContentPolicy);
    response.set("Referrer-Policy", "no-referrer");
    response.keep_alive(keep_alive);
  }

  static Response Text(http::status status, std::string text, unsigned version, bool keep_alive) {
    Response response(status, version);
    SetFields(response, "text/plain; charset=utf-8", keep_alive);
    response.body() = std::move(text);
    response.prepare_payload();
    return response;
  }

  template <typename Message>
  void Answer(Message response) {
    constexpr bool kIsFile = std::is_same_v<Message, FileResponse>;
    const auto kept = std::make_shared<Message>(std::move(response));
    stream_.expires_after(kIsFile ? kFileTimeout : kTimeout);
    http::async_write(stream_, *kept,
                      [self = shared_from_this(), kept](beast::error_code error, size_t) {
                        if (error || kept->need_eof() || !kept->keep_alive()) return self->End();
                        self->Read();
                      });
  }

  void End() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  beast::tcp_stream stream_;
  std::shared_ptr<ServerState> server_;
  std::shared_ptr<void> token_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
};

// Answers that there are too many connections. It reads what the client sends before it closes,
// since otherwise the client could lose the answer.
class Refusal : public std::enable_shared_from_this<Refusal> {
 public:
  Refusal(tcp::socket socket, std::shared_ptr<ServerState> server)
      : stream_(std::move(socket)), token_(Counted(server->refusals, server)) {}

  void Run() {
    static constexpr std::string_view kAnswer =
        "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Type: "
        "text/plain\r\nRetry-After: "
        "1\r\nContent-Length: 21\r\n\r\ntoo many connections\n";
    stream_.expires_after(std::chrono::seconds(2));
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
  std::shared_ptr<void> token_;
  std::array<char, 1024> rest_{};
  size_t read_ = 0;
};

}  // namespace

void ServeHttp(tcp::socket socket, std::shared_ptr<ServerState> server) {
  std::make_shared<HttpSession>(std::move(socket), std::move(server))->Read();
}

void RefuseConnection(tcp::socket socket, std::shared_ptr<ServerState> server) {
  std::make_shared<Refusal>(std::move(socket), std::move(server))->Run();
}

}  // namespace oaslam
