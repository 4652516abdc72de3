#include "oaslam/net/gzipped.h"

#include <stdexcept>

#include "matchers.h"

namespace oaslam {
namespace {

// printf 'ring a ring a ring a roses\n' | gzip -9n
constexpr unsigned char kRoses[] = {0x1f, 0x8b, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02,
                                    0x03, 0x2b, 0xca, 0xcc, 0x4b, 0x57, 0x48, 0x54, 0x28,
                                    0x42, 0xa5, 0xf2, 0x8b, 0x53, 0x8b, 0xb9, 0x00, 0xb2,
                                    0x62, 0xa0, 0xa6, 0x1b, 0x00, 0x00, 0x00};
const std::string kText = "ring a ring a ring a roses\n";

std::string Roses() { return {reinterpret_cast<const char*>(kRoses), sizeof(kRoses)}; }

TEST(Gzipped, IsUnpacked) {
  EXPECT_EQ(Gunzip(Roses()), kText);
  std::string damaged = Roses();
  damaged[12] = '\x7f';
  EXPECT_THROW(Gunzip(damaged), std::logic_error);
  EXPECT_THROW(Gunzip(""), std::logic_error);
}

TEST(Gzipped, AClientAcceptsItAsItsHeaderSays) {
  for (const char* header :
       {"gzip", "GZip", "deflate, gzip", "gzip, deflate, br, zstd", "gzip;q=0.001", "*",
        "br, *;q=0.1", "identity, gzip", "identity;q=0.5, gzip;q=1.0", "gzip ; q=1", "*;q=0, gzip",
        "identity;q=0, gzip;q=0.1"})
    EXPECT_TRUE(AcceptsGzip(header)) << header;
  for (const char* header :
       {"", "identity", "br", "gzip;q=0", "gzip;q=0.000", "*, gzip;q=0", "*;q=0", "xgzip",
        "identity;q=1, gzip;q=0.5", "identity, *;q=0.5", "gzip;q=", "gzip;q=x", ";;gzip"})
    EXPECT_FALSE(AcceptsGzip(header)) << header;
}

TEST(Gzipped, TheAnswerIsWhatTheClientAccepts) {
  HttpRequest request;
  const HttpAnswer plain = GzippedAnswer(request, Roses(), "text/plain");
  EXPECT_EQ(plain.body, kText);
  EXPECT_EQ(plain.content_type, "text/plain");
  EXPECT_THAT(plain.fields, ElementsAre(Pair("Vary", "Accept-Encoding")));
  request.fields.set("Accept-Encoding", "gzip");
  const HttpAnswer gzipped = GzippedAnswer(request, Roses(), "text/plain");
  EXPECT_EQ(gzipped.body, Roses());
  EXPECT_THAT(gzipped.fields,
              ElementsAre(Pair("Vary", "Accept-Encoding"), Pair("Content-Encoding", "gzip")));
}

}  // namespace
}  // namespace oaslam
