#include "other_programs.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

namespace oaslam::apps {
namespace {

constexpr const char* kServer = "oaslam-server";
constexpr const char* kViewer = kViewerProgram.data();

struct OtherCommand {
  const char *name, *help, *program;
};
constexpr OtherCommand kOtherCommands[] = {
    {"view", "Show a saved map, or the folder of a run, in the browser", kViewer},
    {"serve", "Answer where cameras are in saved maps, over HTTP and WebSocket", kServer},
    {"models", "List the detectors, fetch or add one", kServer}};

// Returns only where it cannot be run: beside this program or in PATH.
void Become(const char* program, char** argv) {
  std::error_code error;
  const auto beside =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / program;
  execv(beside.c_str(), argv);
  execvp(program, argv);
}

// Whether somebody sits there and sees the question. A process in the background would be stopped
// when it reads from the terminal.
bool IsAtTerminal() {
  return isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1 && isatty(STDERR_FILENO) == 1 &&
         tcgetpgrp(STDIN_FILENO) == getpgrp();
}

}  // namespace

void AddOtherCommands(CLI::App& app) {
  for (const OtherCommand& command : kOtherCommands) {
    const auto is_it = [&](const CLI::App* known) { return known->get_name() == command.name; };
    if (app.get_subcommands(is_it).empty()) app.add_subcommand(command.name, command.help);
  }
}

const char* OtherProgram(int argc, const char* const* argv) {
  if (argc < 2) return nullptr;
  const std::string_view name = argv[1];
  for (const OtherCommand& command : kOtherCommands)
    if (name == command.name) return command.program;
  for (int i = 2; i < argc && name == "run" && argv[i] != std::string_view("--"); ++i)
    for (const char* option : {"--viewer", "--port"})
      if (std::string_view(argv[i]).starts_with(option)) return kViewer;
  return nullptr;
}

int PassTo(const char* program, char** argv) {
  constexpr const char* kPassed = "OASLAM_PASSED_TO";
  const char* before = std::getenv(kPassed);
  // What has this name may be this very program: then it would pass on for ever.
  if (!before || before != std::string_view(program)) {
    setenv(kPassed, program, 1);
    Become(program, argv);
    if (errno != ENOENT) {
      fmt::print(stderr, "error: {}: {}\n", program, std::strerror(errno));
      return 1;
    }
  }
  const bool is_run = argv[1] == std::string_view("run");
  fmt::print(stderr,
             "error: oaslam {}{}: {} is not installed: it is in the package {}, or built by "
             "cmake --build BUILD --target {}\n",
             argv[1], is_run ? " --viewer" : "", program, program, program);
  return 1;
}

bool OfferDetector() {
  if (!IsAtTerminal()) return false;
  const pid_t child = fork();
  if (child == 0) {
    std::array<std::string, 3> words{kServer, "models", "offer"};
    char* arguments[] = {words[0].data(), words[1].data(), words[2].data(), nullptr};
    Become(kServer, arguments);
    _exit(1);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return false;
  if (WEXITSTATUS(status) == 130) throw CLI::RuntimeError(130);
  return WEXITSTATUS(status) == 0;
}

}  // namespace oaslam::apps
