#pragma once

#include <string>
#include <string_view>

#include "oaslam/net/http_service.h"

namespace oaslam {

// The answer with a document that is stored as gzip -n writes it: so for clients that accept gzip
// (Accept-Encoding), else unpacked.
HttpAnswer GzippedAnswer(const HttpRequest& request, std::string_view gzipped,
                         const std::string& content_type);

// Whether a client with this header Accept-Encoding accepts gzip, and prefers no other way to have
// a document unpacked (RFC 9110, 12.5.3).
bool AcceptsGzip(std::string_view accept_encoding);

// Unpacks what gzip -n has written.
std::string Gunzip(std::string_view gzipped);

}  // namespace oaslam
