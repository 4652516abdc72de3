#include "server_program.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

namespace oaslam::apps {
namespace {

constexpr const char* kServer = "oaslam-server";

struct ServerCommand {
  const char *name, *help;
};
constexpr ServerCommand kServerCommands[] = {
    {"serve", "Answer where cameras are in saved maps, over HTTP and WebSocket"},
    {"models", "List the detectors, fetch or add one"}};

// Returns only where it is neither beside this program nor in PATH.
void BecomeServer(char** argv) {
  std::error_code error;
  const auto beside =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / kServer;
  execv(beside.c_str(), argv);
  execvp(kServer, argv);
}

// Whether somebody sits there and sees the question. A process in the background would be stopped
// when it reads from the terminal.
bool IsAtTerminal() {
  return isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1 && isatty(STDERR_FILENO) == 1 &&
         tcgetpgrp(STDIN_FILENO) == getpgrp();
}

}  // namespace

void AddServerCommands(CLI::App& app) {
  for (const ServerCommand& command : kServerCommands)
    app.add_subcommand(command.name, command.help);
}

bool IsForServer(int argc, const char* const* argv) {
  if (argc < 2) return false;
  for (const ServerCommand& command : kServerCommands)
    if (std::string_view(argv[1]) == command.name) return true;
  return false;
}

int PassToServer(char** argv) {
  BecomeServer(argv);
  fmt::print(stderr,
             "error: oaslam {}: {} is not installed: it is in the package {}, or built by "
             "cmake --build BUILD --target oaslam_server\n",
             argv[1], kServer, kServer);
  return 1;
}

bool OfferDetector() {
  if (!IsAtTerminal()) return false;
  const pid_t child = fork();
  if (child == 0) {
    std::array<std::string, 3> words{kServer, "models", "offer"};
    char* arguments[] = {words[0].data(), words[1].data(), words[2].data(), nullptr};
    BecomeServer(arguments);
    _exit(1);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return false;
  if (WEXITSTATUS(status) == 130) throw CLI::RuntimeError(130);
  return WEXITSTATUS(status) == 0;
}

}  // namespace oaslam::apps
