#include "oaslam/net/gzipped.h"

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <boost/beast/zlib/inflate_stream.hpp>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>

#include "oaslam/util/check.h"
#include "oaslam/util/trim.h"

namespace oaslam {

namespace beast = boost::beast;

namespace {

// "q=0.5"; 0 where it is malformed.
double Weight(std::string_view text) {
  double q = 0;
  const bool is_weight = text.starts_with("q=") || text.starts_with("Q=");
  if (!is_weight || std::from_chars(text.begin() + 2, text.end(), q).ptr != text.end()) return 0;
  return q;
}

}  // namespace

bool AcceptsGzip(std::string_view accept_encoding) {
  std::optional<double> gzip, identity, any;
  while (!accept_encoding.empty()) {
    const std::string_view item = accept_encoding.substr(0, accept_encoding.find(','));
    accept_encoding.remove_prefix(std::min(item.size() + 1, accept_encoding.size()));
    const size_t semicolon = item.find(';');
    const std::string coding(Trim(item.substr(0, semicolon)));
    const double q =
        semicolon == std::string_view::npos ? 1 : Weight(Trim(item.substr(semicolon + 1)));
    if (beast::iequals(coding, "gzip")) gzip = q;
    if (beast::iequals(coding, "identity")) identity = q;
    if (coding == "*") any = q;
  }
  const double of_gzip = gzip.value_or(any.value_or(0));
  return of_gzip > 0 && of_gzip >= identity.value_or(0);
}

std::string Gunzip(std::string_view gzipped) {
  // Around the compressed bytes (RFC 1952): a header, to which -n adds nothing; a checksum and the
  // size of the text.
  constexpr size_t kHeader = 10, kTrailer = 8;
  OASLAM_CHECK(gzipped.size() > kHeader + kTrailer);
  uint32_t size = 0;
  std::memcpy(&size, gzipped.data() + gzipped.size() - sizeof(size), sizeof(size));
  std::string text(size, '\0');
  beast::zlib::z_params parameters;
  parameters.next_in = gzipped.data() + kHeader;
  // With the trailer: the decoder wants more bits than the last code has.
  parameters.avail_in = gzipped.size() - kHeader;
  parameters.next_out = text.data();
  parameters.avail_out = text.size();
  boost::system::error_code end;
  beast::zlib::inflate_stream().write(parameters, beast::zlib::Flush::finish, end);
  OASLAM_CHECK(end == beast::zlib::error::end_of_stream && parameters.avail_out == 0);
  return text;
}

HttpAnswer GzippedAnswer(const HttpRequest& request, std::string_view gzipped,
                         const std::string& content_type) {
  HttpAnswer answer;
  answer.content_type = content_type;
  // What stands between does not give the answer for one client to another of the other kind.
  answer.fields.emplace_back("Vary", "Accept-Encoding");
  const auto accepted = request.fields[beast::http::field::accept_encoding];
  if (AcceptsGzip({accepted.data(), accepted.size()})) {
    answer.fields.emplace_back("Content-Encoding", "gzip");
    answer.body = gzipped;
  } else {
    answer.body = Gunzip(gzipped);
  }
  return answer;
}

}  // namespace oaslam
