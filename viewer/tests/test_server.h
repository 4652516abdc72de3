#pragma once

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <istream>
#include <iterator>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "oaslam/net/http_server.h"

namespace oaslam {

// How long tests wait for an event that must happen; reached only in failing tests.
constexpr std::chrono::seconds kAtMost{60};

inline bool Comes(const std::future<void>& event) {
  return event.wait_for(kAtMost) == std::future_status::ready;
}

// A service whose behaviour a test sets before the server starts. All of it is called on the
// server's thread.
struct TestService : HttpService {
  std::function<void(HttpRequest, Reply)> handle = [](HttpRequest request, Reply reply) {
    reply({.body = request.path + " " + request.body});
  };
  std::function<Access(const HttpRequest&)> access = [](const HttpRequest&) {
    return Access::kRead;
  };
  std::function<BodyPlan(const HttpRequest&)> plan = [](const HttpRequest&) {
    return BodyPlan{1000, ""};
  };
  std::function<std::shared_ptr<WebSocketHandler>()> upgrade = [] { return nullptr; };

  Access AccessFor(const HttpRequest& head) const override { return access(head); }
  BodyPlan PlanBody(const HttpRequest& head) override { return plan(head); }
  void Handle(HttpRequest request, Reply reply) override {
    handle(std::move(request), std::move(reply));
  }
  std::shared_ptr<WebSocketHandler> Upgrade(const HttpRequest& /*request*/) override {
    return upgrade();
  }
};

// Keeps requests until the test answers them.
class HeldRequests {
 public:
  std::function<void(HttpRequest, HttpService::Reply)> Handler() {
    return [this](HttpRequest request, HttpService::Reply reply) {
      const std::scoped_lock lock(mutex_);
      held_.emplace_back(std::move(request), std::move(reply));
      came_.notify_all();
    };
  }
  void WaitFor(size_t count) {
    std::unique_lock lock(mutex_);
    if (!came_.wait_for(lock, kAtMost, [&] { return held_.size() >= count; }))
      throw std::runtime_error("the requests have not come");
  }
  // Answers all with this body. The replies are still kept.
  void Answer(const std::string& body) {
    const std::scoped_lock lock(mutex_);
    for (const auto& [request, reply] : held_) reply({.body = body});
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<std::pair<HttpRequest, HttpService::Reply>> held_;
};

// A server on a thread of its own, on this machine.
class TestServer {
 public:
  explicit TestServer(std::shared_ptr<HttpService> service, ServerOptions options = {})
      : server_(io_, options, std::move(service)), port_(server_.port()) {
    server_.Start();
    thread_ = std::jthread([this] { io_.run(); });
  }
  ~TestServer() {
    boost::asio::post(io_, [this] {
      server_.Close();
      work_.reset();
    });
    thread_.join();
  }

  unsigned short port() const { return static_cast<unsigned short>(port_); }
  // Ready when the server has ended.
  std::future<void> Drain() {
    const auto ended = std::make_shared<std::promise<void>>();
    boost::asio::post(io_, [this, ended] { server_.Drain([ended] { ended->set_value(); }); });
    return ended->get_future();
  }

 private:
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      io_.get_executor()};
  HttpServer server_;
  const int port_;
  std::jthread thread_;
};

// A connection to a server on this machine, as bytes.
class RawClient {
 public:
  // `receive_buffer`: of the socket, in bytes; 0: as usual.
  explicit RawClient(unsigned short port, int receive_buffer = 0)
      : stream_(Connected(port, receive_buffer)) {
    stream_.expires_after(kAtMost);
  }

  // False once this end knows that the server has closed the connection.
  bool Send(const std::string& bytes) {
    stream_ << bytes << std::flush;
    return stream_.good();
  }
  // Reads until the server ends the connection. Throws where it does not.
  std::string ReadAll() {
    std::string bytes{std::istreambuf_iterator<char>(stream_), {}};
    if (stream_.error() != boost::asio::error::eof &&
        stream_.error() != boost::asio::error::connection_reset)
      throw std::runtime_error("the server has not ended the connection");
    return bytes;
  }
  std::string Read(size_t count) {
    std::string bytes(count, '\0');
    stream_.read(bytes.data(), static_cast<std::streamsize>(count));
    bytes.resize(static_cast<size_t>(stream_.gcount()));
    return bytes;
  }
  // Reads one answer, whose header states its length.
  std::string ReadAnswer() {
    std::string header;
    while (!header.ends_with("\r\n\r\n")) {
      const std::string next = Read(1);
      if (next.empty()) return header;
      header += next;
    }
    const size_t length = header.find("Content-Length: ");
    if (length == std::string::npos) return header;
    return header + Read(std::stoul(header.substr(length + 16)));
  }
  // Sends nothing more, but still reads.
  void EndSending() { stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send); }

 private:
  boost::asio::ip::tcp::socket Connected(unsigned short port, int receive_buffer) {
    boost::asio::ip::tcp::socket socket(io_);
    socket.open(boost::asio::ip::tcp::v4());
    if (receive_buffer > 0)
      socket.set_option(boost::asio::socket_base::receive_buffer_size(receive_buffer));
    socket.connect({boost::asio::ip::address_v4::loopback(), port});
    return socket;
  }

  boost::asio::io_context io_;
  boost::asio::ip::tcp::iostream stream_;
};

inline std::string Get(const std::string& path, const std::string& fields = {}) {
  return "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n";
}

// The whole answer to some bytes, until the connection ends.
inline std::string AnswerTo(const TestServer& server, const std::string& bytes) {
  RawClient client(server.port());
  client.Send(bytes);
  return client.ReadAll();
}

}  // namespace oaslam
