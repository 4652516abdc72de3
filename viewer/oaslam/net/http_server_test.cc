#include "oaslam/net/http_server.h"

#include "expect_input_error.h"
#include "temp_folder.h"
#include "test_server.h"

namespace oaslam {
namespace {

std::string Post(const std::string& fields, const std::string& body) {
  return "POST /p HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n" + body;
}
std::string PostOf(const std::string& body) {
  return Post("Content-Length: " + std::to_string(body.size()) + "\r\n", body);
}

class Http : public testing::Test {
 protected:
  const std::shared_ptr<TestService> service_ = std::make_shared<TestService>();
};

TEST_F(Http, AnswersTheRequestsOfAConnectionInOrder) {
  const TestServer server(service_);
  RawClient client(server.port());
  client.Send(Get("/a") + PostOf("body") + "HEAD /c HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(client.ReadAnswer(),
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("X-Content-Type-Options: nosniff"),
                    HasSubstr("Cache-Control: no-store"), EndsWith("\r\n\r\n/a ")));
  EXPECT_THAT(client.ReadAnswer(), EndsWith("/p body"));
  client.Send("GET /d HTTP/1.0\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(client.ReadAll(), AllOf(HasSubstr("Content-Length: 3\r\n"), EndsWith("\r\n\r\n/d "),
                                      Not(HasSubstr("/c"))));
}

TEST_F(Http, MalformedRequestsAreRefusedAndOthersStillAnswered) {
  const TestServer server(service_);
  for (const std::string& bytes :
       {std::string("nonsense\r\n\r\n"), std::string("\0\xff\x16\x03\x01 \r\n\r\n", 10),
        std::string("GET\r\n\r\n"), std::string("GET / HTTP/9.9\r\n\r\n"), Get("/", "No colon\r\n"),
        Get("/", "Bad name: 1\r\n"), Get("maps"), Get("/%zz"), Post("Content-Length: -1\r\n", ""),
        Post("Content-Length: 1x\r\n", "1"),
        Post("Content-Length: 99999999999999999999999\r\n", ""),
        Post("Content-Length: 1\r\nContent-Length: 2\r\n", "12"),
        Post("Content-Length: 4\r\nTransfer-Encoding: chunked\r\n", "0\r\n\r\n"),
        Post("Transfer-Encoding: nonsense\r\n", "1"),
        Post("Transfer-Encoding: chunked\r\n", "xyz\r\n")})
    EXPECT_THAT(AnswerTo(server, bytes), StartsWith("HTTP/1.1 400 ")) << bytes;
  EXPECT_THAT(AnswerTo(server, "GET / HTTP/1.1\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 403 "));  // without Host
  EXPECT_THAT(AnswerTo(server, Get("/a", "Connection: close\r\n")), EndsWith("/a "));
}

TEST_F(Http, TheHostOfAWholeAddressCounts) {
  const TestServer server(service_);
  const auto answer = [&](const std::string& target) {
    return AnswerTo(server, Get(target, "Connection: close\r\n"));
  };
  EXPECT_THAT(answer("http://127.0.0.1:99/a?x=1"), EndsWith("\r\n\r\n/a "));
  EXPECT_THAT(answer("http://evil.example/a"), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(answer("http://user@localhost/a"), StartsWith("HTTP/1.1 403 "));
}

TEST_F(Http, ABodyInACodingIsRefused) {
  const TestServer server(service_);
  for (const char* length : {"Content-Length: 4\r\n", "Transfer-Encoding: chunked\r\n"})
    EXPECT_THAT(AnswerTo(server, Post(std::string("Content-Encoding: gzip\r\n") + length, "")),
                AllOf(StartsWith("HTTP/1.1 415 "), HasSubstr("gzip is not accepted")));
  EXPECT_THAT(AnswerTo(server, Post("Transfer-Encoding: gzip, chunked\r\n", "")),
              AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("gzip, chunked is not accepted")));
}

TEST_F(Http, WhatEndsTooEarlyIsNotARequest) {
  const TestServer server(service_);
  for (const std::string& bytes :
       {std::string(), std::string("GET / HT"), Post("Content-Length: 9\r\n", "12345")}) {
    RawClient client(server.port());
    client.Send(bytes);
    client.EndSending();
    EXPECT_THAT(client.ReadAll(), Not(HasSubstr(" 200 "))) << bytes;
  }
}

TEST_F(Http, BodiesAreBounded) {
  const TestServer server(service_);
  const std::string most(1000, 'x');
  RawClient client(server.port());
  client.Send(PostOf(most));
  EXPECT_THAT(client.ReadAnswer(), EndsWith(most));
  client.Send(Post("Transfer-Encoding: chunked\r\n", "3e8\r\n" + most + "\r\n0\r\n\r\n"));
  EXPECT_THAT(client.ReadAnswer(), EndsWith(most));
  for (const std::string& request :
       {PostOf(most + "x"), Post("Content-Length: 1001\r\n", ""),
        Post("Content-Length: 9999999999999\r\nExpect: 100-continue\r\n", ""),
        Post("Transfer-Encoding: chunked\r\n", "3e9\r\n" + most + "x\r\n0\r\n\r\n")})
    EXPECT_THAT(AnswerTo(server, request),
                AllOf(StartsWith("HTTP/1.1 413 "), HasSubstr("1000 bytes")))
        << request;
}

TEST_F(Http, HeadersAreBounded) {
  const TestServer server(service_);
  const auto with = [](size_t bytes) {
    return Get("/", "Connection: close\r\nX: " + std::string(bytes, 'x') + "\r\n");
  };
  EXPECT_THAT(AnswerTo(server, with(8000)), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(AnswerTo(server, with(8192)), StartsWith("HTTP/1.1 431 "));
  // Before the header ends, which it never does.
  EXPECT_THAT(AnswerTo(server, "GET /" + std::string(10'000, 'x')), StartsWith("HTTP/1.1 431 "));
}

TEST_F(Http, ABodyIsAskedFor) {
  const TestServer server(service_);
  RawClient client(server.port());
  client.Send(Post("Content-Length: 4\r\nExpect: 100-continue\r\n", ""));
  EXPECT_THAT(client.ReadAnswer(), StartsWith("HTTP/1.1 100 "));
  client.Send("body");
  EXPECT_THAT(client.ReadAnswer(), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("/p body")));
}

TEST_F(Http, ABodyMayGoToAFile) {
  const TempFolder folder;
  const std::string path = folder / "body";
  std::string body_file, content;
  service_->plan = [&](const HttpRequest&) { return HttpService::BodyPlan{1000, path}; };
  service_->handle = [&](HttpRequest request, HttpService::Reply reply) {
    body_file = request.body_file;
    content = folder.Read("body") + request.body;
    reply({});
  };
  {
    const TestServer server(service_);
    RawClient client(server.port());
    client.Send(PostOf("body"));
    EXPECT_THAT(client.ReadAnswer(), StartsWith("HTTP/1.1 200 "));
    // Now the file is the service's, which has not removed it. It is not overwritten.
    EXPECT_THAT(AnswerTo(server, PostOf("other")), StartsWith("HTTP/1.1 500 "));
  }
  EXPECT_EQ(body_file, path);
  EXPECT_EQ(content, "body");
  EXPECT_EQ(folder.Read("body"), "body");
  // What is broken off is removed.
  std::filesystem::remove(path);
  {
    const TestServer server(service_);
    for (const std::string& request : {Post("Content-Length: 9\r\n", "12345"),
                                       Post("Transfer-Encoding: chunked\r\n", "z\r\n")}) {
      RawClient client(server.port());
      client.Send(request);
      client.EndSending();
      client.ReadAll();
    }
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(Http, AnAnswerMayComeFromAFile) {
  const TempFolder folder;
  const std::string content(3'000'000, 'x');
  const HttpAnswer answer{.file = folder.Write("model", content)};
  service_->handle = [&](const HttpRequest&, const HttpService::Reply& reply) { reply(answer); };
  const TestServer server(service_);
  RawClient client(server.port());
  client.Send(Get("/"));
  EXPECT_THAT(client.ReadAnswer(), EndsWith("\r\n\r\n" + content));
  EXPECT_THAT(AnswerTo(server, "HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"),
              AllOf(HasSubstr("Content-Length: 3000000"), EndsWith("\r\n\r\n")));
  std::filesystem::remove(answer.file);
  client.Send(Get("/"));
  EXPECT_THAT(client.ReadAnswer(), StartsWith("HTTP/1.1 404 "));
}

TEST_F(Http, ErrorsOfTheServiceEndOneRequestOnly) {
  const auto fails_for = [](const HttpRequest& request, const char* path) {
    if (request.path == path) throw std::runtime_error("no memory");
  };
  service_->access = [=](const HttpRequest& request) {
    fails_for(request, "/access");
    return Access::kNone;
  };
  service_->plan = [=](const HttpRequest& request) {
    fails_for(request, "/plan");
    return HttpService::BodyPlan{};
  };
  service_->handle = [=](const HttpRequest& request, const HttpService::Reply& reply) {
    fails_for(request, "/handle");
    reply({});
  };
  const TempFolder folder;
  ServerOptions options;
  options.token_file = folder.Write("tokens", "read reader-of-maps-1");
  const TestServer server(service_, options);
  for (const char* path : {"/access", "/plan", "/handle"})
    EXPECT_THAT(AnswerTo(server, Get(path)),
                AllOf(StartsWith("HTTP/1.1 500 "), Not(HasSubstr("no memory"))));
  EXPECT_THAT(AnswerTo(server, Get("/", "Connection: close\r\n")), StartsWith("HTTP/1.1 200 "));
}

// The connection belongs to the server's thread, which ends it.
TEST_F(Http, AServiceThatKeepsItsReplyKeepsNoConnection) {
  HeldRequests held;
  service_->handle = held.Handler();
  ServerOptions options;
  options.farewell = 10 * kAtMost;
  TestServer server(service_, options);
  {
    RawClient client(server.port());
    client.Send(Get("/", "Connection: close\r\n"));
    held.WaitFor(1);
    held.Answer("done");
    EXPECT_THAT(client.ReadAll(), EndsWith("done"));
  }
  EXPECT_TRUE(Comes(server.Drain()));
}

}  // namespace
}  // namespace oaslam
