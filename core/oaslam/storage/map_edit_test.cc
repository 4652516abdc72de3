#include "oaslam/storage/map_edit.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <set>
#include <thread>
#include <vector>

#include "expect_input_error.h"
#include "folder_test.h"
#include "random_map.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

void Place(const std::string& name, SavedMap& saved) {
  saved.map.anchors[name] = {"flag", 1, saved.map.keyframes.Ids().front(), {}, {}, {0, 0, 0}};
}

// Runs in a process of its own, which ends with 0 unless `act` throws.
pid_t InChild(const std::function<void()>& act) {
  const pid_t child = fork();
  if (child != 0) return child;
  try {
    act();
  } catch (const std::exception&) {
    _exit(1);
  }
  _exit(0);
}

int StatusOf(pid_t child) {
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

// Whether a call of the kernel changes files or locks.
bool ChangesFiles(uint64_t call) {
  constexpr std::array kCalls = {
#ifdef SYS_rename
      SYS_rename, SYS_unlink,
#endif
      SYS_write,  SYS_pwrite64, SYS_ftruncate, SYS_fsync,   SYS_fdatasync,
      SYS_flock,  SYS_renameat, SYS_renameat2, SYS_unlinkat};
  return std::ranges::any_of(kCalls,
                             [&](long known) { return call == static_cast<uint64_t>(known); });
}

enum class End { kKilled, kDone, kNotTraced };

// Runs `act` in a process that is killed when it is about to change files for the time `step`.
End KillAtStep(int step, const std::function<void()>& act) {
  const pid_t child = fork();
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(9);
    raise(SIGSTOP);
    act();
    _exit(0);
  }
  const auto resume = [&](int signal) {
    return ptrace(PTRACE_SYSCALL, child, nullptr, signal) == 0;
  };
  int status = StatusOf(child);
  if (!WIFSTOPPED(status)) return End::kNotTraced;
  ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
  int signal = 0;
  while (resume(signal)) {
    status = StatusOf(child);
    if (!WIFSTOPPED(status)) break;
    const bool is_call = WSTOPSIG(status) == (SIGTRAP | 0x80);
    signal = is_call ? 0 : WSTOPSIG(status);
    __ptrace_syscall_info call{};
    if (!is_call || ptrace(PTRACE_GET_SYSCALL_INFO, child, sizeof call, &call) <= 0) continue;
    if (call.op != PTRACE_SYSCALL_INFO_ENTRY || !ChangesFiles(call.entry.nr) || --step > 0)
      continue;
    kill(child, SIGKILL);
    StatusOf(child);
    return End::kKilled;
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  return End::kDone;
}

class MapEditTest : public FolderTest {
 protected:
  MapEditTest() {
    Rng rng(3);
    saved_ = RandomMap({.keyframes = 3, .keypoints = 20, .landmarks = 10}, rng);
    SaveMap(path_, saved_);
  }

  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder.path()))
      names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
  }

  const std::string path_ = folder / "a.map";
  SavedMap saved_;
};

TEST_F(MapEditTest, KeepsTheRest) {
  EditMap(path_, [](SavedMap& saved) { Place("flag", saved); });
  Place("flag", saved_);
  SaveMap(folder / "b.map", saved_);
  EXPECT_TRUE(folder.Read("a.map") == folder.Read("b.map"));
  EXPECT_INPUT_ERROR(EditMap(folder / "none.map", [](SavedMap&) {}), HasSubstr("no such file"));
  const std::string before = folder.Read("a.map");
  EXPECT_INPUT_ERROR(EditMap(path_, [](SavedMap&) { throw InputError("not so"); }), "not so");
  EXPECT_TRUE(folder.Read("a.map") == before);
  EXPECT_THAT(Files(), ElementsAre("a.map", "b.map"));
}

TEST_F(MapEditTest, OfManyProcessesNoneIsLost) {
  constexpr int kProcesses = 6, kEdits = 8;
  std::vector<pid_t> children;
  for (int process = 0; process < kProcesses; ++process)
    children.push_back(InChild([&] {
      for (int i = 0; i < kEdits; ++i)
        EditMap(path_, [&](SavedMap& saved) { Place(fmt::format("{} {}", process, i), saved); });
    }));
  for (const pid_t child : children) EXPECT_EQ(StatusOf(child), 0);
  EXPECT_THAT(LoadMap(path_).map.anchors, SizeIs(kProcesses * kEdits));
  EXPECT_THAT(Files(), ElementsAre("a.map"));
}

TEST_F(MapEditTest, OfManyThreadsNoneIsLost) {
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 8; ++i)
      threads.emplace_back(
          [&, i] { EditMap(path_, [&](SavedMap& saved) { Place(std::to_string(i), saved); }); });
  }
  EXPECT_THAT(LoadMap(path_).map.anchors, SizeIs(8));
}

// A process has the lock, is named by those that wait in vain, and takes its lock with it.
TEST_F(MapEditTest, TheLockNamesItsHolderAndEndsWithIt) {
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  const pid_t child = InChild([&] {
    const MapLock lock(path_);
    if (write(pipe_ends[1], "x", 1) == 1) pause();
  });
  char byte = 0;
  ASSERT_EQ(read(pipe_ends[0], &byte, 1), 1);
  EXPECT_INPUT_ERROR(MapLock(path_, std::chrono::seconds(0)),
                     HasSubstrs(path_, fmt::format("(process {})", child)));
  kill(child, SIGSTOP);  // who is stopped has it still
  EXPECT_INPUT_ERROR(MapLock(folder / "another.map", std::chrono::seconds(0)),
                     HasSubstr(std::to_string(child)));
  kill(child, SIGKILL);
  StatusOf(child);
  EXPECT_TRUE(MapLock(path_, std::chrono::seconds(1)).IsHeld());
  EditMap(path_, [](SavedMap& saved) { Place("flag", saved); });
  for (const int end : pipe_ends) close(end);
}

// A child that was forked while the lock was held does not keep it.
TEST_F(MapEditTest, AForkedChildDoesNotHoldTheLock) {
  std::optional<MapLock> lock(path_);
  const pid_t child = InChild([] { pause(); });
  lock.reset();
  EXPECT_TRUE(MapLock(path_, std::chrono::seconds(0)).IsHeld());
  kill(child, SIGKILL);
  StatusOf(child);
}

TEST_F(MapEditTest, ALinkStaysOne) {
  fs::create_directory(folder / "links");
  fs::create_symlink("../a.map", folder / "links/b.map");
  EditMap(folder / "links/b.map", [](SavedMap& saved) { Place("flag", saved); });
  EXPECT_TRUE(fs::is_symlink(folder / "links/b.map"));
  EXPECT_THAT(LoadMap(path_).map.anchors, SizeIs(1));
}

TEST_F(MapEditTest, WhatWasKilledLeavesIsRemoved) {
  for (const char* name :
       {"a.map.123-4.tmp", "a.map.123.tmp", "a.map.tmp", "a.map.my.tmp", "b.map.123.tmp"})
    folder.Write(name, "");
  EditMap(path_, [](SavedMap& saved) { Place("flag", saved); });
  EXPECT_THAT(Files(), ElementsAre("a.map", "a.map.my.tmp", "a.map.tmp", "b.map.123.tmp"));
}

TEST_F(MapEditTest, TheStateTellsEditsFromOtherMaps) {
  const MapState before = *StateOfMap(path_);
  SaveMap(path_, LoadMap(path_));
  EXPECT_EQ(StateOfMap(path_), before);

  EditMap(path_, [](SavedMap& saved) {
    Place("flag", saved);
    saved.map.objects.MutableAt(saved.map.objects.Ids().front()).name = "mine";
  });
  const MapState edited = *StateOfMap(path_);
  EXPECT_NE(edited.content, before.content);
  EXPECT_EQ(edited.scene, before.scene);

  saved_.map.up_keyframes = 9;
  SaveMap(path_, saved_);
  EXPECT_NE(StateOfMap(path_)->content, edited.content);
  saved_.trajectory.pop_back();
  SaveMap(path_, saved_);
  EXPECT_NE(StateOfMap(path_)->scene, before.scene);

  EXPECT_EQ(StateOfMap(folder / "none.map"), std::nullopt);
  EXPECT_EQ(StateOfMap(folder.Write("text.map", "text")), std::nullopt);
}

// As a program may that knows no lock.
TEST_F(MapEditTest, AFileThatAnotherProgramReplacesIsNotOverwritten) {
  EXPECT_INPUT_ERROR(EditMap(path_,
                             [&](SavedMap& saved) {
                               Place("flag", saved);
                               Place("other", saved_);
                               SaveMap(saved_, MapLock::NotHeld(path_));
                             }),
                     HasSubstrs("a.map", "another program has written it"));
  EXPECT_TRUE(LoadMap(path_).map.anchors.contains("other"));
  EXPECT_THAT(Files(), ElementsAre("a.map"));
}

// At each step the file is the old or the new one, and whoever comes next finds no hindrance.
TEST_F(MapEditTest, AtNoStepDoesAKillDoHarm) {
  const std::string old_content = folder.Read("a.map");
  Place("flag", saved_);
  SaveMap(folder / "new.map", saved_);
  const std::string new_content = folder.Read("new.map");
  fs::remove(folder / "new.map");
  std::set<std::string> found;
  int step = 1;
  for (;; ++step) {
    folder.Write("a.map", old_content);
    const End end =
        KillAtStep(step, [&] { EditMap(path_, [](SavedMap& saved) { Place("flag", saved); }); });
    if (end == End::kNotTraced) GTEST_SKIP() << "this machine does not allow ptrace";
    const std::string content = folder.Read("a.map");
    EXPECT_TRUE(content == old_content || content == new_content) << step;
    found.insert(content);
    if (end == End::kDone) break;
    EXPECT_TRUE(MapLock(path_, std::chrono::seconds(0)).IsHeld()) << step;
    EditMap(path_, [](SavedMap& saved) { Place("next", saved); });
    EXPECT_TRUE(LoadMap(path_).map.anchors.contains("next")) << step;
    EXPECT_THAT(Files(), ElementsAre("a.map")) << step;
  }
  EXPECT_GT(step, 10);  // lock, pages of the file, its sync, its new name, the folder's sync
  EXPECT_THAT(found, SizeIs(2));
}

}  // namespace
}  // namespace oaslam
