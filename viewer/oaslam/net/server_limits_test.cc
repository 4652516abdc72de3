// What the server does about connections that are slow, many, or open when it ends.

#include "expect_input_error.h"
#include "temp_folder.h"
#include "test_server.h"

namespace oaslam {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLittlePatience{100};
constexpr size_t kLarge = 64 << 20;  // bytes, more than the buffers of a connection hold

class ServerLimits : public testing::Test {
 protected:
  ServerLimits() { options_.farewell = 10 * kAtMost; }
  // Requests are held where they ask for it, answers are large where they are asked to be.
  void HoldSome() {
    service_->handle = [hold = held_.Handler()](HttpRequest request, HttpService::Reply reply) {
      if (request.path == "/hold") return hold(std::move(request), std::move(reply));
      reply({.body = request.path == "/large" ? std::string(kLarge, 'x') : request.path});
    };
  }
  // A connection that has had an answer, and waits for its next request.
  static std::unique_ptr<RawClient> Idle(const TestServer& server) {
    auto client = std::make_unique<RawClient>(server.port());
    client->Send(Get("/idle"));
    EXPECT_THAT(client->ReadAnswer(), EndsWith("/idle"));
    return client;
  }
  static void ExpectAnswered(RawClient& client) {
    client.Send(Get("/again"));
    EXPECT_THAT(client.ReadAnswer(), EndsWith("/again"));
  }

  const std::shared_ptr<TestService> service_ = std::make_shared<TestService>();
  HeldRequests held_;
  ServerOptions options_;
};

TEST_F(ServerLimits, AHeaderThatDoesNotComeIsGivenUp) {
  options_.patience = kLittlePatience;
  const TestServer server(service_, options_);
  for (const char* begun : {"", "GET / HTTP/1.1\r\nHost: "}) EXPECT_EQ(AnswerTo(server, begun), "");
}

TEST_F(ServerLimits, AHeaderThatGoesOnComingIsGivenUpToo) {
  options_.patience = kLittlePatience;
  const TestServer server(service_, options_);
  RawClient client(server.port());
  int sent = 0;
  while (client.Send("G") && ++sent < 1000) std::this_thread::sleep_for(milliseconds(10));
  EXPECT_LT(sent, 1000);
}

TEST_F(ServerLimits, ABodyThatComesTooSlowlyIsGivenUp) {
  options_.patience = kLittlePatience;
  options_.least_rate = 1 << 20;
  const TestServer server(service_, options_);
  const std::string head = "POST / HTTP/1.1\r\nHost: localhost\r\n";
  EXPECT_EQ(AnswerTo(server, head + "Content-Length: 100\r\n\r\n12345"), "");
  EXPECT_EQ(AnswerTo(server, head + "Transfer-Encoding: chunked\r\n\r\n5\r\n12345"), "");
}

TEST_F(ServerLimits, AnAnswerThatIsNotReadIsGivenUp) {
  HoldSome();
  options_.patience = kLittlePatience;
  options_.least_rate = uint64_t{1} << 40;
  TestServer server(service_, options_);
  RawClient client(server.port(), 65536);
  client.Send(Get("/large"));
  EXPECT_EQ(client.Read(8), "HTTP/1.1");
  EXPECT_TRUE(Comes(server.Drain()));  // long before its farewell, as no connection is left
  EXPECT_LT(client.ReadAll().size(), kLarge);
}

TEST_F(ServerLimits, ALargeAnswerIsReadInItsTime) {
  HoldSome();
  const TestServer server(service_, options_);
  RawClient client(server.port(), 65536);
  client.Send(Get("/large", "Connection: close\r\n"));
  EXPECT_GT(client.ReadAll().size(), kLarge);
}

TEST_F(ServerLimits, TheConnectionThatIsSilentForLongestMakesPlace) {
  HoldSome();
  options_.max_connections = 3;
  const TestServer server(service_, options_);
  const auto first = Idle(server), second = Idle(server), third = Idle(server);
  ExpectAnswered(*first);
  const auto fourth = Idle(server);
  EXPECT_EQ(second->ReadAll(), "");
  const auto fifth = Idle(server);
  EXPECT_EQ(third->ReadAll(), "");
  for (RawClient* client : {first.get(), fourth.get(), fifth.get()}) ExpectAnswered(*client);
}

TEST_F(ServerLimits, WhereNoneIsSilentTheOneThatSendsLongestMakesPlace) {
  HoldSome();
  options_.max_connections = 2;
  const TestServer server(service_, options_);
  RawClient first(server.port()), second(server.port());
  for (RawClient* client : {&first, &second}) {
    client->Send(
        "POST /body HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\nContent-Length: "
        "5\r\n\r\n");
    EXPECT_THAT(client->Read(25), HasSubstr(" 100 "));  // its body is waited for
  }
  const auto third = Idle(server);
  ExpectAnswered(*third);
  EXPECT_THAT(first.ReadAll(), Not(HasSubstr("200")));
}

TEST_F(ServerLimits, BodiesTogetherAreBounded) {
  HoldSome();
  options_.max_body_bytes = 150;
  const TestServer server(service_, options_);
  const std::string head = "POST /body HTTP/1.1\r\nHost: localhost\r\n";
  const std::string announced = head + "Expect: 100-continue\r\nContent-Length: 100\r\n\r\n";
  RawClient first(server.port());
  first.Send(announced);
  EXPECT_THAT(first.Read(25), HasSubstr(" 100 "));
  EXPECT_THAT(AnswerTo(server, announced), HasSubstrs(" 503 ", "Retry-After: 1"));
  EXPECT_THAT(AnswerTo(server, head + "Connection: close\r\nContent-Length: 50\r\n\r\n" +
                                   std::string(50, 'x')),
              HasSubstr(" 200 "));
  first.Send(std::string(100, 'x'));
  EXPECT_THAT(first.ReadAnswer(), HasSubstr(" 200 "));
  // What the first one has had is free again.
  RawClient second(server.port());
  second.Send(announced);
  EXPECT_THAT(second.Read(25), HasSubstr(" 100 "));
}

TEST_F(ServerLimits, WhereAllAreAtWorkANewOneIsRefused) {
  HoldSome();
  options_.max_connections = 2;
  const TestServer server(service_, options_);
  RawClient one(server.port()), two(server.port());
  for (RawClient* client : {&one, &two}) client->Send(Get("/hold"));
  held_.WaitFor(2);
  EXPECT_THAT(AnswerTo(server, Get("/")),
              AllOf(StartsWith("HTTP/1.1 503 "), HasSubstr("Retry-After: 1\r\n"),
                    EndsWith("too many connections\n")));
  held_.Answer("done");
  for (RawClient* client : {&one, &two}) EXPECT_THAT(client->ReadAnswer(), EndsWith("done"));
  EXPECT_NE(Idle(server), nullptr);  // in place of one of them
}

TEST_F(ServerLimits, ManyMayBeSilent) {
  const TestServer server(service_, options_);
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 300; ++i) {
    silent.push_back(std::make_unique<RawClient>(server.port()));
    if (i % 2 == 0) silent.back()->Send("GET /late HTTP/1.1\r\nHost: ");
  }
  EXPECT_THAT(AnswerTo(server, Get("/other", "Connection: close\r\n")), EndsWith("/other "));
  silent[0]->Send("localhost\r\n\r\n");
  EXPECT_THAT(silent[0]->ReadAnswer(), EndsWith("/late "));
}

TEST_F(ServerLimits, TheEndWaitsForWhatIsUnderWay) {
  HoldSome();
  TestServer server(service_, options_);
  auto working = std::make_unique<RawClient>(server.port());
  working->Send(Get("/hold"));
  held_.WaitFor(1);
  auto idle = Idle(server);
  const std::future<void> ended = server.Drain();
  EXPECT_EQ(idle->ReadAll(), "");
  idle.reset();
  EXPECT_THROW(RawClient(server.port()), boost::system::system_error);
  EXPECT_EQ(ended.wait_for(milliseconds(0)), std::future_status::timeout);
  held_.Answer("done");
  EXPECT_THAT(working->ReadAll(), AllOf(HasSubstr("Connection: close"), EndsWith("done")));
  working.reset();
  EXPECT_TRUE(Comes(ended));
}

TEST_F(ServerLimits, TheEndDoesNotWaitForEver) {
  HoldSome();
  options_.farewell = kLittlePatience;
  TestServer server(service_, options_);
  RawClient client(server.port());
  client.Send(Get("/hold"));
  held_.WaitFor(1);
  EXPECT_TRUE(Comes(server.Drain()));
  EXPECT_EQ(client.ReadAll(), "");
  held_.Answer("too late");
}

TEST_F(ServerLimits, AtOnceItEndsAtOnce) {
  HoldSome();
  auto server = std::make_unique<TestServer>(service_, options_);
  const auto idle = Idle(*server);
  RawClient half(server->port()), working(server->port());
  half.Send("GET / HT");
  working.Send(Get("/hold"));
  held_.WaitFor(1);
  server.reset();
  EXPECT_EQ(idle->ReadAll() + half.ReadAll() + working.ReadAll(), "");
}

TEST_F(ServerLimits, OptionsThatCannotBeAreRefused) {
  boost::asio::io_context io;
  const auto problem = [&](const ServerOptions& options) {
    return InputErrorOf([&] { HttpServer(io, options, service_); });
  };
  const TestServer other(service_, options_);
  ServerOptions taken;
  taken.port = other.port();
  EXPECT_THAT(problem(taken), HasSubstr("port " + std::to_string(taken.port)));
  EXPECT_THAT(problem(taken), HasSubstr("; port 0 takes one that is free"));
  EXPECT_INPUT_ERROR(CheckServer(taken), HasSubstr("the viewer cannot listen"));
  EXPECT_NO_THROW(CheckServer(options_));
  for (const int port : {-1, 65536}) {
    taken.port = port;
    EXPECT_THAT(problem(taken), HasSubstr("allowed: 0 to 65535"));
  }
  ServerOptions elsewhere;
  elsewhere.address = "nowhere.example";
  EXPECT_THAT(problem(elsewhere), HasSubstr("--bind nowhere.example: expected an address"));
  elsewhere.address = "203.0.113.7";  // an address for documentation, of no machine
  elsewhere.insecure = true;
  EXPECT_THAT(problem(elsewhere), HasSubstr("cannot listen at 203.0.113.7"));
  ServerOptions tokens;
  tokens.token_file = "/nowhere/tokens";
  EXPECT_THAT(problem(tokens), HasSubstr("/nowhere/tokens: cannot be read"));
  ServerOptions both;
  both.tls_cert = both.tls_key = "x";
  both.tls_self_signed = true;
  EXPECT_THAT(problem(both), HasSubstr("not together"));
  both.tls_self_signed = false;
  both.tls_key.clear();
  EXPECT_THAT(problem(both), HasSubstr("each needs the other"));
}

TEST_F(ServerLimits, OpenToOthersItWantsTlsAndTokens) {
  ServerOptions open;
  open.address = "0.0.0.0";
  const auto problem = [&] { return InputErrorOf([&] { CheckSafety(open); }); };
  EXPECT_THAT(problem(), HasSubstrs("TLS", " and tokens", "--insecure"));
  open.token_file = "tokens";
  EXPECT_THAT(problem(), AllOf(HasSubstr("TLS"), Not(HasSubstr(" and tokens"))));
  open.tls_self_signed = true;
  EXPECT_NO_THROW(CheckSafety(open));
  open.token_file.clear();
  EXPECT_THAT(problem(), HasSubstr("tokens (--token-file)"));
  open.insecure = true;
  EXPECT_NO_THROW(CheckSafety(open));
  for (const char* address : {"127.0.0.1", "::1", "localhost"}) {
    ServerOptions closed;
    closed.address = address;
    EXPECT_NO_THROW(CheckSafety(closed)) << address;
  }
}

}  // namespace
}  // namespace oaslam
