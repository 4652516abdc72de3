#include "signals.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <thread>

#include "oaslam/formats/leftover.h"

namespace oaslam::apps {
namespace {

constexpr int kInterrupted = 130;  // of a shell, for Ctrl-C

// Written by a signal handler, read by several threads.
std::atomic<int> heard = 0, heard_int = 0;
std::atomic<bool> keeps_results = false, has_saved = false;
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

[[noreturn]] void EndNow() {
  RemoveLeftovers();
  _exit(kInterrupted);
}

// A terminal that closes, or a wrapper, often sends several signals for one: only a person who
// presses Ctrl-C three times means now.
void OnSignal(int which) {
  const bool is_first = ++heard == 1, is_third_int = which == SIGINT && ++heard_int == 3;
  if (!keeps_results || (has_saved && !is_first) || is_third_int) EndNow();
}

void Handle(int which) {
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  sigaction(which, &action, nullptr);
}

}  // namespace

bool HearsHangUp() {
  struct sigaction now = {};
  sigaction(SIGHUP, nullptr, &now);
  return now.sa_handler != SIG_IGN;
}

void EndOnSignals() {
  if (HearsHangUp()) Handle(SIGHUP);
  Handle(SIGINT);
  Handle(SIGTERM);
  keeps_results = false;
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of the write
}

void InstallInterruptHandler() {
  keeps_results = true;
  std::signal(SIGPIPE, SIG_IGN);  // who no longer reads the messages does not end the command
}

bool Interrupted() { return heard > 0; }

void SleepUnlessInterrupted(double seconds) {
  using std::chrono::duration;
  constexpr double kSlice_s = 0.05;  // what nobody notices
  for (; seconds > 0 && !Interrupted(); seconds -= kSlice_s)
    std::this_thread::sleep_for(duration<double>(std::min(seconds, kSlice_s)));
}

void SavedOnSignal() {
  has_saved = true;
  if (heard > 1) EndNow();
}

void EndIfInterrupted() {
  if (!Interrupted()) return;
  std::fflush(stdout);
  EndNow();
}

}  // namespace oaslam::apps
