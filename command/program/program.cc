#include "program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <exception>

#include "common.h"
#include "help.h"
#include "oaslam/detection/network.h"
#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/images/video_container.h"
#include "oaslam/util/log.h"
#include "signals.h"

namespace oaslam::apps {
namespace {

// Messages go to stderr, results to stdout.
void InstallLogger() {
  SilenceFfmpeg();
  spdlog::set_default_logger(spdlog::stderr_color_mt("oaslam"));
  SetMessagePattern("");
  SetLogSink([](LogLevel level, const std::string& message) {
    switch (level) {
      case LogLevel::kDebug:
        return spdlog::debug(message);
      case LogLevel::kInfo:
        return spdlog::info(message);
      case LogLevel::kWarning:
        return spdlog::warn(message);
    }
  });
}

// Nobody gets results that could not be written.
int CheckStdout(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  spdlog::error("standard output: cannot be written");
  return code != 0 ? code : 1;
}

// The arguments of the command, in reverse order as CLI11 wants them, with the numbers filled in
// that were left out. CLI11 would take the next argument for one, such as the images in
// `oaslam run --viewer walk.mp4`.
std::vector<std::string> WithOptionalNumbers(int argc, const char* const* argv,
                                             const std::vector<OptionalNumber>& numbers) {
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) {
    std::string argument = argv[i];
    if (argument == "--") {  // what follows is no option
      arguments.insert(arguments.end(), argv + i, argv + argc);
      break;
    }
    const auto number = std::ranges::find(numbers, argument, &OptionalNumber::option);
    if (number != numbers.end()) {
      const bool has_value = i + 1 < argc && ParseNumber(argv[i + 1]);
      argument += "=" + (has_value ? argv[++i] : number->if_left_out);
    }
    arguments.push_back(std::move(argument));
  }
  std::ranges::reverse(arguments);
  return arguments;
}

int Parse(CLI::App& app, const char* overview, int argc, char** argv,
          const std::vector<OptionalNumber>& numbers) {
  app.name("oaslam");
  app.set_version_flag("--version",
                       fmt::format("oaslam {}\nDetectors are run by {}.", OASLAM_VERSION,
                                   fmt::join(NetworkBackends(), " or ")));
  app.require_subcommand(1);
  GroupOptions(app);
  if (argc < 2) {
    fmt::print("{}", overview);
    // A script that forgot the command gets an error.
    return 1;
  }
  try {
    app.parse(WithOptionalNumbers(argc, argv, numbers));
  } catch (const CLI::ParseError& error) {
    // An option that is not known may have left its value to be taken for an argument: it is the
    // cause, whatever that led to.
    const std::string unknown = error.get_exit_code() != 0 ? UnknownOption(app) : "";
    const int code = unknown.empty() ? app.exit(error) : app.exit(CLI::ExtrasError({unknown}));
    if (const std::string meant = DidYouMean(app); code != 0 && !meant.empty())
      fmt::print(stderr, "{}\n", meant);
    return code;
  } catch (const InputError& error) {
    spdlog::error(error.what());
    return 1;
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) return Interrupted() ? 130 : 1;
    spdlog::error("unexpected: {}", error.what());
    return 2;
  }
  return 0;
}

}  // namespace

int RunProgram(CLI::App& app, const char* overview, int argc, char** argv,
               const std::vector<OptionalNumber>& numbers) {
  InstallLogger();
  EndOnSignals();
  return CheckStdout(Parse(app, overview, argc, argv, numbers));
}

}  // namespace oaslam::apps
