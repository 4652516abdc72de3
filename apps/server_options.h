#pragma once

#include <CLI/CLI.hpp>

#include "oaslam/net/http_server.h"

namespace oaslam::apps {

// --bind, --tls-cert, --tls-key, --tls-self-signed, --token-file, --insecure, --host: how a command
// that serves may be reached. `options` must outlive the parsing.
void AddServerOptions(CLI::App& app, ServerOptions& options);

}  // namespace oaslam::apps
