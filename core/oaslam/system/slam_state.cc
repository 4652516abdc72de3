#include "oaslam/slam_state.h"

#include <algorithm>
#include <utility>

#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/system/state_board.h"
#include "oaslam/util/named.h"

namespace oaslam {

namespace {

constexpr Named<SlamEventKind> kEventKinds[] = {{SlamEventKind::kState, "state"},
                                                {SlamEventKind::kWorld, "world"},
                                                {SlamEventKind::kAnchorPlaced, "anchor placed"},
                                                {SlamEventKind::kAnchorEdited, "anchor edited"},
                                                {SlamEventKind::kAnchorRemoved, "anchor removed"}};

}  // namespace

const char* ToString(SlamEventKind kind) { return NameIn(kEventKinds, kind); }

void SlamStates::Board::Add(SlamEventKind kind, const std::string& anchor) {
  constexpr size_t kMost = 1000;
  const TrackingResult& now = newest->result;
  events.push_back({++last_number_, kind, now.frame, now.state, now.world, anchor});
  if (events.size() > kMost) events.pop_front();
}

void SlamStates::Board::Post(std::shared_ptr<const SlamState> state,
                             const std::string& edited_anchor) {
  const std::unique_lock lock = Lock();
  is_closed = !state;
  if (state) {
    const std::shared_ptr<const SlamState> before = std::exchange(newest, std::move(state));
    if (before) AddEventsSince(*before, edited_anchor);
  }
  changed.notify_all();
}

void SlamStates::Board::AddEventsSince(const SlamState& before, const std::string& edited_anchor) {
  const TrackingResult &then = before.result, &now = newest->result;
  if (now.world != then.world) Add(SlamEventKind::kWorld);
  if (now.state != then.state) Add(SlamEventKind::kState);
  if (MapOf(before.map) == MapOf(newest->map)) return;
  const auto &had = MapOf(before.map)->anchors, &has = MapOf(newest->map)->anchors;
  for (const auto& [name, anchor] : had)
    if (!has.contains(name)) Add(SlamEventKind::kAnchorRemoved, name);
  for (const auto& [name, anchor] : has)
    if (!had.contains(name)) Add(SlamEventKind::kAnchorPlaced, name);
  if (had.contains(edited_anchor) && has.contains(edited_anchor))
    Add(SlamEventKind::kAnchorEdited, edited_anchor);
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
  const auto first = std::ranges::upper_bound(board_->events, number, {}, &SlamEvent::number);
  return {first, board_->events.end()};
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
