#include "oaslam/net/request_check.h"

#include <map>
#include <tuple>

#include "matchers.h"
#include "temp_folder.h"
#include "test_server.h"

namespace oaslam {
namespace {

namespace http = boost::beast::http;

const std::string kReader = "reader-of-maps-1", kWriter = "writer-of-maps-1";

std::optional<HttpRequest> Requested(const std::string& target) {
  RequestHead head(http::verb::get, target, 11);
  head.set(http::field::host, "localhost");
  return RequestOf(head, "192.0.2.7", false);
}

TEST(RequestOf, DecodesThePathAndTheQuery) {
  const auto request = Requested("/v1/a%20flag/%C3%BC+%2f?mode=a+b%26c&&since=&flag&x=1=2&x=3&");
  ASSERT_TRUE(request);
  EXPECT_EQ(request->path, "/v1/a flag/\xC3\xBC+/");
  EXPECT_THAT(request->query, ElementsAre(Pair("flag", ""), Pair("mode", "a b&c"),
                                          Pair("since", ""), Pair("x", "3")));
  EXPECT_EQ(request->fields[http::field::host], "localhost");
  EXPECT_EQ(request->caller.address, "192.0.2.7");
  EXPECT_FALSE(request->caller.is_local);
  EXPECT_EQ(request->caller.access, Access::kNone);
  EXPECT_EQ(Requested("/?a?b")->query.at("a?b"), "");
}

TEST(RequestOf, ATargetThatIsNoPathIsNoRequest) {
  for (const char* target :
       {"", "*", "maps", "localhost:80", "/%", "/%4", "/%zz", "/a%00b", "/?x=%", "/?%0g=1",
        "/?a=%00", "%2Fmaps/%", "ftp://localhost/", "http:/localhost/", "http://localhost/%"})
    EXPECT_FALSE(Requested(target)) << target;
}

TEST(RequestOf, AWholeAddressHasAPathAndTheHost) {
  for (const auto& [target, host, path] :
       {std::tuple{"http://desk:8340/v1/a%20b", "desk:8340", "/v1/a b"},
        {"HTTPS://desk/", "desk", "/"},
        {"http://[::1]:80", "[::1]:80", "/"},
        {"http://desk?since=3", "desk", "/"},
        {"http://a@desk//v1", "a@desk", "/v1"},
        {"http:///v1", "", "/v1"}}) {
    const auto request = Requested(target);
    ASSERT_TRUE(request) << target;
    EXPECT_EQ(request->path, path);
    EXPECT_EQ(request->fields[http::field::host], host);
  }
  EXPECT_EQ(Requested("http://desk?since=3")->query.at("since"), "3");
}

TEST(RequestOf, SlashesThatAProxyDoublesCountOnce) {
  EXPECT_EQ(Requested("//ws")->path, "/ws");
  EXPECT_EQ(Requested("///")->path, "/");
  EXPECT_EQ(Requested("//v1//maps")->path, "/v1//maps");
}

TEST(CheckCoding, ABodyInACodingIsRefusedByItsName) {
  const auto answer = [](const std::map<std::string, std::string>& fields) {
    http::fields head;
    for (const auto& [name, value] : fields) head.insert(name, value);
    return CheckCoding(head);
  };
  for (const char* coding : {"gzip", "br", "identity, gzip", "a\xff"}) {
    const auto refusal = answer({{"Content-Encoding", coding}, {"Content-Length", "9"}});
    ASSERT_TRUE(refusal) << coding;
    EXPECT_EQ(refusal->status, http::status::unsupported_media_type);
    EXPECT_THAT(refusal->fields, ElementsAre(Pair("Accept-Encoding", "identity")));
  }
  EXPECT_EQ(answer({{"Content-Encoding", "gzip"}, {"Transfer-Encoding", "chunked"}})->body,
            "Content-Encoding: gzip is not accepted, the body must be sent as it is\n");
  EXPECT_EQ(answer({{"Transfer-Encoding", "gzip, chunked"}})->body,
            "Transfer-Encoding: gzip, chunked is not accepted, allowed: chunked\n");
  EXPECT_FALSE(answer({{"Content-Encoding", "Identity"}, {"Content-Length", "9"}}));
  EXPECT_FALSE(answer({{"Content-Encoding", "gzip"}}));
  EXPECT_FALSE(answer({{"Content-Encoding", "gzip"}, {"Content-Length", "0"}}));
  EXPECT_FALSE(answer({{"Transfer-Encoding", "Chunked"}}));
}

// What a server with tokens says to a request with these fields, for something that needs `needed`.
class RequestCheck : public testing::Test {
 protected:
  RequestCheck() {
    core_.service = service_;
    core_.host_names = {"desk"};
    core_.tokens =
        Tokens::Load(folder_.Write("tokens", "read " + kReader + "\nwrite " + kWriter + "\n"));
    service_->access = [this](const HttpRequest&) { return needed_; };
  }
  // The status of the refusal, 200 for none.
  int Status(const std::map<std::string, std::string>& fields) {
    request_ = {};
    request_.fields.set(http::field::host, "localhost:8340");
    for (const auto& [name, value] : fields) request_.fields.set(name, value);
    refusal_ = CheckRequest(core_, request_);
    return refusal_ ? static_cast<int>(refusal_->status) : 200;
  }
  int StatusWith(const std::string& token) {
    return Status({{"Authorization", "Bearer " + token}});
  }

  const TempFolder folder_;
  const std::shared_ptr<TestService> service_ = std::make_shared<TestService>();
  ServerCore core_;
  Access needed_ = Access::kRead;
  HttpRequest request_;
  std::optional<HttpAnswer> refusal_;
};

TEST_F(RequestCheck, WithoutTokensEveryoneMayWrite) {
  core_.tokens.reset();
  needed_ = Access::kWrite;
  EXPECT_EQ(Status({}), 200);
  EXPECT_EQ(request_.caller.access, Access::kWrite);
  EXPECT_FALSE(request_.caller.has_token);
}

TEST_F(RequestCheck, HostsAndOriginsOfOthersAreRefused) {
  core_.tokens.reset();
  EXPECT_EQ(Status({{"Host", "Desk:8340"}}), 200);
  EXPECT_EQ(Status({{"Host", "evil.example"}}), 403);
  EXPECT_THAT(refusal_->body, HasSubstr("--host"));
  EXPECT_EQ(Status({{"Host", ""}}), 403);
  EXPECT_EQ(Status({{"Origin", "http://localhost:8340"}}), 200);
  EXPECT_EQ(Status({{"Origin", "http://localhost:8341"}}), 403);
  EXPECT_EQ(Status({{"Origin", "null"}}), 403);
}

TEST_F(RequestCheck, ATokenAllowsWhatItIsFor) {
  EXPECT_EQ(StatusWith(kReader), 200);
  EXPECT_EQ(request_.caller.access, Access::kRead);
  EXPECT_TRUE(request_.caller.has_token);
  EXPECT_EQ(StatusWith(kWriter), 200);
  EXPECT_EQ(request_.caller.access, Access::kWrite);
  needed_ = Access::kWrite;
  EXPECT_EQ(StatusWith(kWriter), 200);
  EXPECT_EQ(StatusWith(kReader), 403);
  EXPECT_THAT(refusal_->body, HasSubstr("reading only"));
  needed_ = Access::kNone;
  EXPECT_EQ(Status({}), 200);
  EXPECT_EQ(StatusWith("nobody-has-this-1"), 200);
  EXPECT_EQ(request_.caller.access, Access::kNone);
}

TEST_F(RequestCheck, WithoutATokenThatIsKnownOneIsAskedFor) {
  EXPECT_EQ(Status({}), 401);
  EXPECT_THAT(refusal_->fields, ElementsAre(Pair("WWW-Authenticate", "Bearer")));
  for (const std::string& authorization :
       {std::string("Bearer"), std::string("Bearer "), std::string("Bearer nobody-has-this-1"),
        "Bearer " + kReader + " 1", "Basic " + kReader, kReader, "Bearer  " + kReader})
    EXPECT_EQ(Status({{"Authorization", authorization}}), 401) << authorization;
}

// Pages cannot set the header Authorization of a WebSocket.
TEST_F(RequestCheck, AWebSocketHasItsTokenAmongTheSubprotocols) {
  const auto status = [&](const std::string& protocols) {
    return Status({{"Sec-WebSocket-Protocol", protocols}});
  };
  EXPECT_EQ(status("oaslam, oaslam.token." + kReader), 200);
  EXPECT_EQ(status("oaslam.token." + kWriter + " ,oaslam"), 200);
  EXPECT_EQ(status("oaslam"), 401);
  EXPECT_EQ(status(kReader), 401);
  EXPECT_EQ(status("oaslam.token."), 401);
  EXPECT_EQ(status("oaslam.token.nobody-has-this-1"), 401);
  EXPECT_EQ(status(",,;= \"oaslam.token." + kReader), 401);
}

}  // namespace
}  // namespace oaslam
