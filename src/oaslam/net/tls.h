#pragma once

#include <boost/asio/ssl/context.hpp>
#include <memory>

#include "oaslam/net/http_server.h"

namespace oaslam {

// The certificate and key of a server, or null where the options have none. A self-signed one (EC
// P-256) is made for this run, for localhost, `hosts` and the address; its SHA-256 fingerprint is
// logged. Throws InputError that names the file.
std::unique_ptr<boost::asio::ssl::context> MakeTls(const ServerOptions& options);

}  // namespace oaslam
