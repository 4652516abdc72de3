#pragma once

#include <pwd.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "temp_folder.h"

namespace oaslam {

// A PostgreSQL server of its own, with a fresh database cluster in a temporary folder, reached by
// a socket there. Stopped by the destructor.
class PostgresServer {
 public:
  // The folder of the newest version of Debian's packages; empty where there is none.
  static std::string Programs() {
    std::string newest;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator("/usr/lib/postgresql", error))
      if (std::filesystem::exists(entry.path() / "bin/initdb") &&
          (newest.empty() || std::stoi(entry.path().filename()) > std::stoi(Version(newest))))
        newest = entry.path() / "bin";
    return newest;
  }

  PostgresServer() {
    // The server refuses to run as root.
    if (geteuid() == 0) {
      const passwd* const user = getpwnam(getpwnam("postgres") ? "postgres" : "nobody");
      if (!user || chown(folder_.path().c_str(), user->pw_uid, user->pw_gid) != 0)
        throw std::runtime_error("no user to run PostgreSQL as");
      as_user_ = std::string("runuser -u ") + user->pw_name + " -- ";
    }
    Call("initdb --auth=trust --username=oaslam --encoding=UTF8 --no-sync -D " + folder_ / "data");
    Start();
  }
  ~PostgresServer() {
    try {
      Stop();
    } catch (const std::runtime_error&) {
      // It was stopped.
    }
  }

  void Start() {
    Call("pg_ctl -w -D " + folder_ / "data" + " -l " + folder_ / "log" + " -o \"-c fsync=off -c " +
         "listen_addresses='' -k " + folder_.path() + "\" start");
  }
  // Stops at once, which breaks connections.
  void Stop() { Call("pg_ctl -w -m immediate -D " + folder_ / "data" + " stop"); }

  // Suspends its processes until they are resumed.
  void Freeze() { Signal(SIGSTOP); }
  void GoOn() { Signal(SIGCONT); }

  // Runs SQL by psql, in the database `postgres`.
  void Run(const std::string& sql) {
    Call("psql -q -v ON_ERROR_STOP=1 -h " + folder_.path() + " -U oaslam -d postgres -c \"" + sql +
         "\"");
  }

  // The URI of a database of the server.
  std::string Uri(const std::string& database) const {
    return "postgresql://oaslam:a-password@/" + database + "?host=" + folder_.path();
  }

 private:
  static std::string Version(const std::string& programs) {
    return std::filesystem::path(programs).parent_path().filename();
  }

  void Signal(int signal) {
    const std::string first = std::to_string(std::stoi(folder_.Read("data/postmaster.pid")));
    std::ifstream children("/proc/" + first + "/task/" + first + "/children");
    kill(std::stoi(first), signal);
    for (pid_t child; children >> child;) kill(child, signal);
  }

  void Call(const std::string& command) {
    const std::string line = "cd / && " + as_user_ + Programs() + "/" + command + " >>" +
                             (folder_ / "output") + " 2>&1 </dev/null";
    const pid_t child = fork();
    if (child == 0) {
      // The server outlives this call: no file of the test may stay open in it.
      close_range(3, ~0U, 0);
      execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      _exit(127);
    }
    int status = -1;
    if (waitpid(child, &status, 0) < 0 || status != 0)
      throw std::runtime_error(command + ": " + folder_.Read("output"));
  }

  TempFolder folder_;
  std::string as_user_;
};

}  // namespace oaslam
