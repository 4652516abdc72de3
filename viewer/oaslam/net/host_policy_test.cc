#include "oaslam/net/host_policy.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

TEST(HostPolicy, AddressesAndThisMachineAreHosts) {
  for (const char* host : {"localhost", "LocalHost:8340", "127.0.0.1:8340", "192.168.1.5",
                           "[::1]:8340", "desk", "Desk:80", "maps.example:443"})
    EXPECT_TRUE(IsAllowedHost(host, {"desk", "maps.example"})) << host;
}

TEST(HostPolicy, ForeignNamesAreNot) {
  for (const char* host :
       {"", "evil.example", "evil.example:8340", "localhost.evil.example", "127.0.0.1.evil.example",
        "localhost:80:80", "localhost:port", "[::1", "[::1]x", "[]", ":80", "localhost:123456"})
    EXPECT_FALSE(IsAllowedHost(host, {"desk", "maps.example"})) << host;
}

TEST(HostPolicy, OnlyTheVeryHostIsAnOrigin) {
  EXPECT_TRUE(IsAllowedOrigin("", "localhost:8340"));
  EXPECT_TRUE(IsAllowedOrigin("http://localhost:8340", "localhost:8340"));
  EXPECT_TRUE(IsAllowedOrigin("https://localhost:8340", "localhost:8340"));
  for (const char* origin : {"http://localhost:8341", "ws://localhost:8340", "http://evil.example",
                             "null", "http://localhost:8340.evil.example", "http://127.0.0.1:8340"})
    EXPECT_FALSE(IsAllowedOrigin(origin, "localhost:8340")) << origin;
}

// As proxies pass on the host with it.
TEST(HostPolicy, TheUsualPortOfASchemeIsNoneInAnOrigin) {
  EXPECT_TRUE(IsAllowedOrigin("https://maps.example", "Maps.example:443"));
  EXPECT_TRUE(IsAllowedOrigin("http://[::1]", "[::1]:80"));
  EXPECT_TRUE(IsAllowedOrigin("https://maps.example", "maps.example"));
  EXPECT_FALSE(IsAllowedOrigin("https://maps.example", "maps.example:80"));
  EXPECT_FALSE(IsAllowedOrigin("http://maps.example", "maps.example:443"));
  EXPECT_FALSE(IsAllowedOrigin("https://maps.example", "maps.example:8443"));
}

}  // namespace
}  // namespace oaslam
