#pragma once

#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <string>

#include "oaslam/net/http_server.h"

namespace oaslam {

// The certificate and key of a server, or null where the options have none. A self-signed one (EC
// P-256) is made for this run, for localhost, `hosts` and the address. Throws InputError that names
// the file.
std::unique_ptr<boost::asio::ssl::context> MakeTls(const ServerOptions& options);

// The SHA-256 of a server's certificate, as "AB:CD:...".
std::string FingerprintOf(boost::asio::ssl::context& tls);

}  // namespace oaslam
