#include "fetch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <string>

#include "oaslam/detection/model_folders.h"
#include "oaslam/error.h"
#include "oaslam/models/model_store.h"
#include "oaslam/util/user_folders.h"
#include "signals.h"

namespace oaslam::apps {
namespace {

namespace fs = std::filesystem;

// Progress of a download: one line on a terminal, a line every tenth otherwise.
class DownloadProgress {
 public:
  DownloadProgress(std::string name, int64_t bytes, bool quiet)
      : name_(std::move(name)), bytes_(bytes), quiet_(quiet) {}
  ~DownloadProgress() {
    if (is_drawn_) std::fputs("\n", stderr);
  }
  DownloadProgress(const DownloadProgress&) = delete;
  DownloadProgress& operator=(const DownloadProgress&) = delete;

  void Update(int64_t done) {
    const int64_t tenth = done * 10 / bytes_;
    if (quiet_ || done == done_ || (!is_terminal_ && tenth == tenth_)) return;
    done_ = done;
    tenth_ = tenth;
    const std::string line = fmt::format("{}: {:3} %, {:.1f} of {}", name_, done * 100 / bytes_,
                                         static_cast<double>(done) / 1e6, SizeText(bytes_));
    std::fputs((is_terminal_ ? "\r" + line : line + "\n").c_str(), stderr);
    is_drawn_ = is_terminal_;
  }

 private:
  std::string name_;
  int64_t bytes_, done_ = 0, tenth_ = 0;
  bool quiet_, is_terminal_ = isatty(STDERR_FILENO) == 1, is_drawn_ = false;
};

// Notes that the user is asked. Returns false if that was noted before, or cannot be.
bool NoteQuestion() {
  const auto state = UserFolder("XDG_STATE_HOME", ".local/state");
  if (!state) return false;
  std::error_code error;
  fs::create_directories(*state / "oaslam", error);
  const fs::path note = *state / "oaslam" / "asked_for_detector";
  const int file = open(note.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644);
  if (file < 0) return false;
  close(file);
  return true;
}

bool AskToFetch(const PublishedModel& model) {
  fmt::print(stderr,
             "Objects are found by a detector, and the default one is not here yet. Fetch {} ({}, "
             "{}, from {})? [y/N] ",
             model.name, SizeText(model.bytes), model.licence, WithoutPassword(model.url));
  std::fflush(stderr);
  std::string answer;
  return std::getline(std::cin, answer) && (answer.starts_with('y') || answer.starts_with('Y'));
}

}  // namespace

std::optional<fs::path> FetchForUser(const PublishedModel& model, bool replace, int timeout_s,
                                     bool quiet) {
  InstallInterruptHandler();
  DownloadProgress progress(model.name, model.bytes, quiet);
  const auto path = FetchModel(model, FolderForModels(), replace,
                               {.timeout_s = timeout_s, .progress = [&](int64_t done) {
                                  progress.Update(done);
                                  return !Interrupted();
                                }});
  EndOnSignals();
  return path;
}

fs::path FolderForModels() {
  if (const auto folder = UserModelFolder()) return *folder;
  throw InputError("neither XDG_DATA_HOME nor HOME tells where models are kept");
}

int OfferDefaultModel() {
  const std::vector<PublishedModel> catalogue = ModelCatalogue();
  const PublishedModel* model = FindPublished(catalogue, kDefaultModel);
  if (model == nullptr || !UserModelFolder() || !NoteQuestion() || !AskToFetch(*model)) return 1;
  try {
    return FetchForUser(*model, false, DownloadOptions{}.timeout_s, false) ? 0 : 130;
  } catch (const InputError& error) {
    spdlog::warn(error.what());
    return 1;
  }
}

}  // namespace oaslam::apps
