#include "server_options.h"

#include <fmt/format.h>

#include "common.h"

namespace oaslam::apps {

CLI::Option* AddPortOption(CLI::App& app, ServerOptions& options) {
  options.port = kViewerPort;
  return app
      .add_option("--port", options.port,
                  fmt::format("port, {} unless given; 0: any that is free", kViewerPort))
      ->check(CLI::Range(0, 65535));
}

CLI::Option* AddModelOption(CLI::App& app, std::vector<std::string>& files) {
  return AddRepeatable(
             app, "--model", files,
             "a model of virtual content (.glb, .gltf), named as its file; may be repeated")
      ->type_name("FILE");
}

void AddServerOptions(CLI::App& app, ServerOptions& options) {
  app.add_option("--bind", options.address,
                 "address to serve at, this machine only unless given; 0.0.0.0: open to other "
                 "machines, which needs TLS and tokens")
      ->type_name("ADDR");
  app.add_option("--tls-cert", options.tls_cert, "PEM file of a certificate, with its chain");
  app.add_option("--tls-key", options.tls_key, "PEM file of its key");
  app.add_flag("--tls-self-signed", options.tls_self_signed,
               "make a certificate for this run; browsers ask before they accept it");
  app.add_option("--token-file", options.token_file,
                 "file with lines \"read TOKEN\" and \"write TOKEN\": who may do what");
  app.add_flag("--insecure", options.insecure,
               "open to other machines without TLS or without tokens, too");
  app.add_option("--host", options.hosts,
                 "name by which it is called besides that of the machine, as behind a proxy; may "
                 "be repeated")
      ->type_name("NAME");
}

}  // namespace oaslam::apps
