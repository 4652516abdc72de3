#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "oaslam/map_viewer.h"
#include "oaslam/net/http_server.h"

namespace oaslam::apps {

constexpr int kViewerPort = MapViewerOptions::kDefaultPort;

// --port; returns the option.
CLI::Option* AddPortOption(CLI::App& app, ServerOptions& options);
// --model, files of models of virtual content; may be repeated. Returns the option.
CLI::Option* AddModelOption(CLI::App& app, std::vector<std::string>& files);
// --bind, --tls-cert, --tls-key, --tls-self-signed, --token-file, --insecure, --host: how a command
// that serves may be reached. `options` must outlive the parsing.
void AddServerOptions(CLI::App& app, ServerOptions& options);

}  // namespace oaslam::apps
