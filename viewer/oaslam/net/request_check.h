#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/message.hpp>
#include <optional>

#include "oaslam/net/server_core.h"

namespace oaslam {

using RequestHead = boost::beast::http::request<boost::beast::http::empty_body>;

// The request of a head, without its body. Nothing for a target that is neither a path nor an
// address with one.
std::optional<HttpRequest> RequestOf(const RequestHead& head, const std::string& address,
                                     bool is_local);

// Finds out what the caller may do, and sets it. Returns the answer where the request is refused:
// because of its host or origin, or since the service wants a token for it.
std::optional<HttpAnswer> CheckRequest(const ServerCore& core, HttpRequest& request);

// The answer where the body of a request with these fields cannot be read, since it is coded.
std::optional<HttpAnswer> CheckCoding(const boost::beast::http::fields& fields);

// Sets the fields of an answer, and those that forbid what no answer needs.
void SetFields(const HttpAnswer& answer, boost::beast::http::fields& fields);

HttpAnswer TextAnswer(boost::beast::http::status status, const std::string& text);

}  // namespace oaslam
