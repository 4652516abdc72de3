#pragma once

#include <chrono>
#include <future>

namespace oaslam::apps {

// What Ctrl-C, TERM and HUP do. The exit status is 130 for each of them.
//
// At first they end the command at once: nothing is lost, as nothing was computed, and no half
// written file and no empty folder stay (Leftover).
void EndOnSignals();
// False under nohup.
bool HearsHangUp();

// From now on a signal is only noted, since there are results to save: the command asks
// Interrupted, and finishes. A second signal ends it as soon as the results have been saved
// (SavedOnSignal), a third Ctrl-C at once.
void InstallInterruptHandler();
bool Interrupted();
// Returns early once it is interrupted.
void SleepUnlessInterrupted(double seconds);

// Waits for a future; returns false, early, once it is interrupted.
template <typename Future>
bool IsReadyUnlessInterrupted(const Future& future) {
  constexpr std::chrono::milliseconds kSlice{50};  // what nobody notices
  while (future.wait_for(kSlice) != std::future_status::ready)
    if (Interrupted()) return false;
  return true;
}

// To be called once what was computed before the first signal is in files: further signals may cut
// off what only improves it.
void SavedOnSignal();
// Where the command was interrupted, and all is saved: ends it with status 130, without waiting for
// what its threads still do.
void EndIfInterrupted();

}  // namespace oaslam::apps
