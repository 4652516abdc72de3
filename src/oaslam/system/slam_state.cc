#include "oaslam/slam_state.h"

#include <utility>

#include "oaslam/system/state_board.h"

namespace oaslam {

SlamStates::SlamStates(std::shared_ptr<Board> board) : board_(std::move(board)) {}

std::shared_ptr<const SlamState> SlamStates::Newest() const { return board_->Newest(); }

bool SlamStates::HasEnded() const { return board_->IsClosed(); }

std::shared_ptr<const SlamState> SlamStates::WaitForNext(
    const std::shared_ptr<const SlamState>& last, std::chrono::milliseconds timeout) const {
  return board_->WaitForNext(last, timeout);
}

}  // namespace oaslam
