#include <atomic>
#include <optional>

#include "matchers.h"
#include "test_server.h"
#include "web_socket_client.h"

namespace oaslam {
namespace {

using Client = WebSocketClient;
using std::chrono::milliseconds;

constexpr size_t kMaxMessage = 1000;
constexpr int kFlood = 64;  // messages of 1 MiB, more than the buffers of a connection hold

// Sends back what comes; "flood": many messages, each as soon as the one before is written.
class Echo : public WebSocketHandler {
 public:
  size_t MaxMessage() const override { return kMaxMessage; }
  void OnOpen(std::shared_ptr<WebSocketConnection> connection) override {
    connection_ = std::move(connection);
  }
  void OnMessage(std::string message, bool is_text) override {
    EXPECT_FALSE(is_closed_);
    if (message == "flood") return Flood();
    if (message == "close") return connection_->Close(1008);
    connection_->Send(std::move(message), is_text);
  }
  void OnWritten() override {
    EXPECT_FALSE(connection_->IsWriting());
    if (flooded_ > 0 && flooded_ < kFlood) Flood();
  }
  void OnClosed() override {
    EXPECT_FALSE(std::exchange(is_closed_, true));
    connection_ = nullptr;
    closed_.set_value();
  }

  std::future<void> Closed() { return closed_.get_future(); }
  int flooded() const { return flooded_; }

 private:
  void Flood() {
    connection_->Send(std::string(1 << 20, static_cast<char>(flooded_++)), false);
    EXPECT_TRUE(connection_->IsWriting());
  }

  std::shared_ptr<WebSocketConnection> connection_;
  std::atomic<int> flooded_ = 0;
  bool is_closed_ = false;
  std::promise<void> closed_;
};

class WebSocketTest : public testing::Test {
 protected:
  WebSocketTest() {
    options_.farewell = 10 * kAtMost;
    service_->upgrade = [this] {
      const std::scoped_lock lock(mutex_);
      return handlers_.emplace_back(std::make_shared<Echo>());
    };
  }
  std::shared_ptr<Echo> LastHandler() {
    const std::scoped_lock lock(mutex_);
    return handlers_.back();
  }

  const std::shared_ptr<TestService> service_ = std::make_shared<TestService>();
  ServerOptions options_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<Echo>> handlers_;
};

TEST_F(WebSocketTest, MessagesGoBothWays) {
  const TestServer server(service_, options_);
  Client client(server.port());
  EXPECT_EQ(client.Ask("text"), "text");
  EXPECT_TRUE(client.got_text());
  const std::string bytes("\0\xff\x80", 3);
  EXPECT_EQ(client.Ask(bytes, false), bytes);
  EXPECT_FALSE(client.got_text());
  EXPECT_EQ(client.Ask(""), "");
}

// A browser wants one of those that it offered, or none if it offered none.
TEST_F(WebSocketTest, OurSubprotocolIsChosenWhereItIsOffered) {
  const TestServer server(service_, options_);
  EXPECT_EQ(Client(server.port()).protocol(), "");
  EXPECT_EQ(Client(server.port(), "chat").protocol(), "");
  EXPECT_EQ(Client(server.port(), "oaslam.token.abc, oaslam").protocol(), "oaslam");
}

TEST_F(WebSocketTest, ElsewhereThereIsNone) {
  service_->upgrade = [] { return nullptr; };
  const TestServer server(service_, options_);
  EXPECT_THROW(Client{server.port()}, boost::system::system_error);
  const std::string fields =
      "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  EXPECT_THAT(AnswerTo(server, Get("/", fields)), StartsWith("HTTP/1.1 404 "));
  // A page of another server is not even told that.
  EXPECT_THAT(AnswerTo(server, Get("/", fields + "Origin: http://evil.example\r\n")),
              StartsWith("HTTP/1.1 403 "));
}

TEST_F(WebSocketTest, MessagesAreBounded) {
  const TestServer server(service_, options_);
  Client client(server.port());
  const std::string most(kMaxMessage, 'x');
  EXPECT_EQ(client.Ask(most), most);
  client.Send(most + "x");
  EXPECT_EQ(client.ReadClose(), 1009);
  EXPECT_TRUE(Comes(LastHandler()->Closed()));
  Client in_parts(server.port());
  for (const std::string& part : {most, std::string("x")}) in_parts.SendPart(part);
  EXPECT_EQ(in_parts.ReadClose(), 1009);
}

TEST_F(WebSocketTest, AnOpenOneMakesNoPlaceForOthers) {
  options_.max_connections = 2;
  const TestServer server(service_, options_);
  Client silent(server.port());
  {
    Client other(server.port());
    EXPECT_THAT(AnswerTo(server, Get("/")), StartsWith("HTTP/1.1 503 "));
    EXPECT_EQ(other.Ask("here"), "here");
  }
  EXPECT_TRUE(Comes(LastHandler()->Closed()));
  EXPECT_THAT(AnswerTo(server, Get("/", "Connection: close\r\n")), StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(silent.Ask("here"), "here");
}

TEST_F(WebSocketTest, MalformedFramesEndTheirConnectionOnly) {
  const TestServer server(service_, options_);
  Client other(server.port());
  // What follows the first byte is masked by zeros.
  const std::string mask(4, '\0');
  const std::string of_two = "\x82" + mask;
  for (const std::string& frame :
       {std::string("\x81\x02hi"),                                             // not masked
        "\x83" + of_two + "hi", "\x8b" + of_two + "hi",                        // opcodes of nothing
        "\xc1" + of_two + "hi",                                                // a reserved bit
        "\x81" + of_two + "\xff\xfe",                                          // no UTF-8
        "\x09" + of_two + "hi",                                                // a ping in pieces
        "\x89\xfe" + std::string("\0\x7e", 2) + mask + std::string(126, 'x'),  // too long a ping
        "\x80" + of_two + "hi",                             // goes on with nothing
        "\x82\xff\xff" + std::string(7, '\xff') + mask}) {  // of 2^64 bytes
    RawClient client(server.port());
    client.Send(Get("/",
                    "Connection: Upgrade\r\nUpgrade: websocket\r\n"
                    "Sec-WebSocket-Version: 13\r\n"
                    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"));
    EXPECT_THAT(client.ReadAnswer(), StartsWith("HTTP/1.1 101 "));
    const std::shared_ptr<Echo> handler = LastHandler();
    client.Send(frame);
    client.EndSending();
    EXPECT_THAT(client.ReadAll(), Not(HasSubstr("hi")));
    EXPECT_TRUE(Comes(handler->Closed()));
  }
  EXPECT_EQ(other.Ask("still there"), "still there");
}

TEST_F(WebSocketTest, TheHandlerMayClose) {
  const TestServer server(service_, options_);
  Client client(server.port());
  client.Send("close");
  EXPECT_EQ(client.ReadClose(), 1008);
  EXPECT_TRUE(Comes(LastHandler()->Closed()));
}

// Who sends each message once the one before is written never sends more than the connection takes.
TEST_F(WebSocketTest, WhoDoesNotReadIsNotSentMore) {
  const TestServer server(service_, options_);
  Client stalled(server.port());
  const std::shared_ptr<Echo> handler = LastHandler();
  stalled.Send("flood");
  Client other(server.port());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(other.Ask("here"), "here");
  EXPECT_LT(handler->flooded(), kFlood);
  for (int i = 0; i < kFlood; ++i)
    EXPECT_EQ(stalled.Read(), std::string(1 << 20, static_cast<char>(i)));
  EXPECT_EQ(stalled.Ask("and then"), "and then");
}

TEST_F(WebSocketTest, WhoDoesNotAnswerIsGivenUp) {
  options_.patience = milliseconds(100);
  const TestServer server(service_, options_);
  Client silent(server.port());
  EXPECT_TRUE(Comes(LastHandler()->Closed()));
  Client stalled(server.port());
  const std::shared_ptr<Echo> handler = LastHandler();
  stalled.Send("flood");
  EXPECT_TRUE(Comes(handler->Closed()));
  EXPECT_LT(handler->flooded(), kFlood);
}

TEST_F(WebSocketTest, ItsHandlerGoesWithTheConnection) {
  const TestServer server(service_, options_);
  std::weak_ptr<Echo> handler;
  std::future<void> closed;
  {
    Client client(server.port());
    client.Ask("text");
    handler = LastHandler();
    closed = handler.lock()->Closed();
    handlers_.clear();
  }
  EXPECT_TRUE(Comes(closed));
  while (!handler.expired()) std::this_thread::yield();  // its last call may not be over
}

TEST_F(WebSocketTest, TheEndOfTheServerIsTold) {
  TestServer server(service_, options_);
  std::optional<Client> client(server.port());
  client->Ask("text");
  const std::future<void> ended = server.Drain();
  EXPECT_EQ(client->ReadClose(), 1001);
  client.reset();
  EXPECT_TRUE(Comes(ended));
  EXPECT_TRUE(Comes(LastHandler()->Closed()));
}

// Neither to the limits of the server, which are for requests in flight.
TEST_F(WebSocketTest, TheEndDoesNotWaitForThoseWhoDoNotListen) {
  options_.patience = 10 * kAtMost;
  TestServer server(service_, options_);
  Client deaf(server.port()), stalled(server.port());
  stalled.Send("flood");
  const std::future<void> ended = server.Drain();
  ASSERT_TRUE(Comes(ended));
  EXPECT_EQ(deaf.ReadClose(), 1001);
  stalled.ReadClose();  // ends, whether it was told or not
}

}  // namespace
}  // namespace oaslam
