#include "oaslam/slam_state.h"

#include <algorithm>
#include <utility>

#include "oaslam/system/state_board.h"
#include "oaslam/util/named.h"

namespace oaslam {

namespace {

constexpr Named<SlamEventKind> kEventKinds[] = {{SlamEventKind::kState, "state"},
                                                {SlamEventKind::kWorld, "world"},
                                                {SlamEventKind::kSubmapBegan, "submap began"},
                                                {SlamEventKind::kSubmapJoined, "submap joined"},
                                                {SlamEventKind::kLoopClosed, "loop closed"},
                                                {SlamEventKind::kMetric, "metric"},
                                                {SlamEventKind::kAnchorPlaced, "anchor placed"},
                                                {SlamEventKind::kAnchorEdited, "anchor edited"},
                                                {SlamEventKind::kAnchorMoved, "anchor moved"},
                                                {SlamEventKind::kAnchorLost, "anchor lost"},
                                                {SlamEventKind::kAnchorRemoved, "anchor removed"}};

}  // namespace

const char* ToString(SlamEventKind kind) { return NameIn(kEventKinds, kind); }

void SlamStates::Board::Post(std::shared_ptr<const SlamState> state,
                             const ChangesBetweenStates& changes) {
  const std::unique_lock lock = Lock();
  is_closed = !state;
  if (state) {
    const std::shared_ptr<const SlamState> before = std::exchange(newest, std::move(state));
    if (before) events.Add(*before, *newest, changes);
  }
  changed.notify_all();
}

std::unique_lock<std::mutex> SlamStates::Board::Lock() {
  if (forks_before_ != ForksBefore()) throw ForkError();
  return std::unique_lock(mutex_);
}

SlamStates::SlamStates(std::shared_ptr<Board> board) : board_(std::move(board)) {}

std::shared_ptr<const SlamState> SlamStates::Newest() const {
  const std::unique_lock lock = board_->Lock();
  return board_->newest;
}

std::vector<SlamEvent> SlamStates::EventsAfter(uint64_t number) const {
  const std::unique_lock lock = board_->Lock();
  return board_->events.After(number);
}

bool SlamStates::HasEnded() const {
  const std::unique_lock lock = board_->Lock();
  return board_->is_closed;
}

std::shared_ptr<const SlamState> SlamStates::WaitForNext(
    const std::shared_ptr<const SlamState>& last, std::chrono::milliseconds timeout) const {
  // The clock's counter would overflow at longer waits.
  constexpr std::chrono::milliseconds kLongest = std::chrono::years(100);
  std::unique_lock lock = board_->Lock();
  board_->changed.wait_for(lock, std::clamp(timeout, std::chrono::milliseconds(0), kLongest),
                           [&] { return board_->newest != last || board_->is_closed; });
  return board_->newest != last ? board_->newest : nullptr;
}

}  // namespace oaslam
