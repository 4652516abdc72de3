#include "oaslam/slam_state.h"

#include <algorithm>
#include <utility>

#include "oaslam/system/state_board.h"

namespace oaslam {

SlamStates::SlamStates(std::shared_ptr<Board> board) : board_(std::move(board)) {}

std::shared_ptr<const SlamState> SlamStates::Newest() const {
  const std::lock_guard lock(board_->mutex);
  return board_->newest;
}

bool SlamStates::HasEnded() const {
  const std::lock_guard lock(board_->mutex);
  return board_->is_closed;
}

std::shared_ptr<const SlamState> SlamStates::WaitForNext(
    const std::shared_ptr<const SlamState>& last, std::chrono::milliseconds timeout) const {
  // The clock's counter would overflow at longer waits.
  constexpr std::chrono::milliseconds kLongest = std::chrono::years(100);
  std::unique_lock lock(board_->mutex);
  board_->changed.wait_for(lock, std::clamp(timeout, std::chrono::milliseconds(0), kLongest),
                           [&] { return board_->newest != last || board_->is_closed; });
  return board_->newest != last ? board_->newest : nullptr;
}

}  // namespace oaslam
