#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "common.h"
#include "default_detector.h"
#include "detector_options.h"
#include "oaslam/service/localization_service.h"
#include "oaslam/util/bad_input.h"
#include "server_commands.h"
#include "server_options.h"

namespace oaslam::apps {
namespace {

struct ServeOptions {
  CommonOptions common;
  ServerOptions server;
  DetectorSettings detector;
  std::vector<std::string> models;
  std::string maps, keep_images;
  int memory_mb = 4096;
  int workers = 0;  // 0: as many as there are cores
};

ServiceOptions ServiceOf(const ServeOptions& options) {
  ServiceOptions service;
  service.config = LoadConfiguration(options.common);
  service.memory_bytes = static_cast<size_t>(options.memory_mb) << 20;
  service.workers = options.workers > 0 ? static_cast<size_t>(options.workers)
                                        : std::max(1U, std::thread::hardware_concurrency());
  const std::unique_ptr<Detector> detector = LoadDetector(options.detector);
  service.classes = ClassesFor(options.common, detector.get());
  if (detector)
    service.make_detector = [settings = options.detector] { return LoadDetector(settings); };
  service.models = std::make_shared<const ModelLibrary>(options.models);
  service.keep_images = options.keep_images;
  if (!options.keep_images.empty()) {
    std::error_code error;
    std::filesystem::create_directories(options.keep_images, error);
    if (error) throw BadInput("--keep-images {}: {}", options.keep_images, error.message());
  }
  service.store = OpenMapStore(options.maps);
  return service;
}

void Serve(ServeOptions options) {
  options.server.what = "the service";
  CheckSafety(options.server);
  const bool has_choice = !options.detector.model.empty();
  if (!has_choice) options.detector.model = DefaultDetectorIfHere();
  cv::setNumThreads(1);  // each image has one worker
  boost::asio::io_context io(1);
  const auto service = std::make_shared<LocalizationService>(ServiceOf(options), io.get_executor());
  HttpServer server(io, options.server, service);
  if (options.server.token_file.empty())
    spdlog::warn("without --token-file everybody who reaches the service may read and write");
  if (!has_choice && !options.detector.IsGiven()) SayHowToGetDetector();
  boost::asio::signal_set ends(io, SIGINT, SIGTERM);
  if (HearsHangUp()) ends.add(SIGHUP);
  ends.async_wait([&](boost::system::error_code error, int) {
    if (error) return;
    spdlog::info("ending: requests in flight are answered");
    server.Drain([&] { io.stop(); });
    // A second signal does not wait for them.
    ends.async_wait([&](boost::system::error_code again, int) {
      if (!again) io.stop();
    });
  });
  server.Start();
  fmt::print("{}\n", server.url());
  std::fflush(stdout);
  while (!io.stopped()) {
    try {
      io.run();
    } catch (const std::exception& error) {  // it ended one connection; the others go on
      spdlog::warn("service: {}", error.what());
    }
  }
  server.Close();
  service->Finish();
  io.restart();
  io.poll();  // lets the connections end
}

}  // namespace

void AddServeCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "serve", "Answer where cameras are in saved maps, over HTTP and WebSocket");
  const auto options = std::make_shared<ServeOptions>();
  command
      ->add_option("--maps", options->maps,
                   "folder of map files, one map file, or postgresql://USER:PASSWORD@HOST/DATABASE")
      ->required();
  AddPortOption(*command, options->server);
  AddServerOptions(*command, options->server);
  command
      ->add_option("--memory", options->memory_mb,
                   "MB for loaded maps; those used least lately make place for others")
      ->check(CLI::Range(16, 1 << 24))
      ->capture_default_str();
  command->add_option("--workers", options->workers, "threads that work; by default one a core")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--keep-images", options->keep_images,
                   "folder for the images that are sent; none is kept unless given")
      ->type_name("DIR");
  AddDetectorOptions(*command, options->detector);
  AddModelOption(*command, options->models);
  AddConfigOptions(*command, options->common);
  AddClassesOption(*command, options->common);
  AddQuietOption(*command, options->common);
  command->callback([options] { Serve(*options); });
}

}  // namespace oaslam::apps
