#include "oaslam/viewer/viewer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <variant>
#ifdef __linux__
#include <sys/resource.h>
#endif

#include "oaslam/storage/map_file.h"
#include "oaslam/util/log.h"
#include "oaslam/viewer/viewer_service.h"

namespace oaslam {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kInterval = std::chrono::milliseconds(40);  // between two updates: 25 a second
constexpr auto kAlignInterval =
    std::chrono::seconds(1);  // between alignments of the ground truth, which look at all poses
constexpr auto kFarewell = std::chrono::seconds(5);  // for viewers to receive the last messages
constexpr auto kClosing = std::chrono::milliseconds(500);  // for the closing handshakes after that
constexpr size_t kMaxCommands = 64;  // that wait; a person gives one or two a second
constexpr int kNoFrame = -1;
using SceneEdit = std::function<void(Scene&)>;
using Mail = std::variant<FrameRecord, SceneEdit>;

// Tracking has priority where both share a processor.
void LowerPriority() {
#ifdef __linux__
  constexpr int kNice = 15;  // of 19: other background work of the system still comes after it
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
#endif
}

ServerOptions ServerOf(const ViewerOptions& options) {
  ServerOptions server = options.server;
  server.max_connections = Viewer::kMaxConnections;
  server.farewell = kClosing;
  return server;
}

}  // namespace

class Viewer::Impl {
 public:
  explicit Impl(ViewerOptions options)
      : options_(std::move(options)),
        scene_(options_.names),
        service_(std::make_shared<ViewerService>(
            scene_,
            ViewerService::Options{
                .accepts_commands = options_.accepts_commands,
                .accepts_anchors = options_.accepts_anchors,
                .models = options_.models,
                .on_command = [this](const ViewerCommand& command) { Receive(command); }})),
        tick_(io_),
        server_(io_, ServerOf(options_), service_),
        url_(server_.url()) {
    server_.Start();
    thread_ = std::jthread([this] {
      LowerPriority();
      while (!io_.stopped()) {
        try {
          io_.run();
          // An error of one connection, such as a lack of memory, does not end the run.
        } catch (const std::exception& error) {
          Log(LogLevel::kWarning, std::string("viewer: ") + error.what());
        }
      }
    });
  }

  ~Impl() { Shutdown(); }

  void Show(FrameRecord record) {
    {
      const std::scoped_lock lock(mutex_);
      // Only the newest frame is drawn; the others keep what the timeline and the trajectory need.
      if (FrameRecord* last = mail_.empty() ? nullptr : std::get_if<FrameRecord>(&mail_.back())) {
        last->image.release();
        last->view.map.reset();
        last->view.frame = {};
        last->view.landmarks = {};
        last->view.detected = {};
      }
      mail_.push_back(std::move(record));
      if (std::exchange(has_mail_, true)) return;
    }
    boost::asio::post(io_, [this] { ScheduleTick(); });
  }

  // Carries out an edit of the scene on the viewer's thread, after the frames shown before it and
  // before those shown later.
  void Edit(SceneEdit edit) {
    {
      const std::scoped_lock lock(mutex_);
      mail_.emplace_back(std::move(edit));
    }
    boost::asio::post(io_, [this] {
      TakeMail();
      ScheduleTick();
    });
  }

  // The same, but blocks while too many edits are queued.
  void EditBounded(SceneEdit edit) {
    constexpr int kMaxWaiting = 4;  // each may hold a picture
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return waiting_edits_ < kMaxWaiting || is_down_; });
      if (is_down_) return;
      ++waiting_edits_;
    }
    Edit([this, edit = std::move(edit)](Scene& scene) {
      edit(scene);
      {
        const std::scoped_lock lock(mutex_);
        --waiting_edits_;
      }
      changed_.notify_all();
    });
  }

  std::vector<ViewerCommand> TakeCommands(int wait_ms) {
    std::unique_lock lock(mutex_);
    if (wait_ms > 0)
      changed_.wait_for(lock, std::chrono::milliseconds(wait_ms),
                        [&] { return !commands_.empty(); });
    has_refused_ = false;
    return std::exchange(commands_, {});
  }

  const std::string& url() const { return url_; }

  void Shutdown() {
    if (!thread_.joinable()) return;
    {
      const std::scoped_lock lock(mutex_);
      is_down_ = true;
    }
    changed_.notify_all();
    boost::asio::post(io_, [this] {
      TakeMail();
      AlignGroundtruth(true);
      farewell_ = Clock::now() + kFarewell;
      Tick();
    });
    thread_.join();
    server_.Close();
    io_.restart();
    io_.poll();  // lets the connections end
  }

 private:
  // Queues a command of a page, or reports that the queue is full: a run may be blocked while a
  // page goes on sending commands.
  void Receive(const ViewerCommand& command) {
    if (!Queue(command)) {
      scene_.AddEvent(kNoFrame, "refused",
                      fmt::format("{} commands wait already; what is asked for until some of them "
                                  "are done is forgotten",
                                  kMaxCommands));
      ScheduleTick();
    }
    changed_.notify_all();
  }

  // Returns false the first time that the queue is full.
  bool Queue(const ViewerCommand& command) {
    const std::scoped_lock lock(mutex_);
    if (commands_.size() >= kMaxCommands) return std::exchange(has_refused_, true);
    commands_.push_back(command);
    return true;
  }

  void TakeMail() {
    std::vector<Mail> mail;
    {
      const std::scoped_lock lock(mutex_);
      mail = std::exchange(mail_, {});
      has_mail_ = false;
    }
    for (Mail& item : mail)
      if (auto* edit = std::get_if<SceneEdit>(&item))
        (*edit)(scene_);
      else
        scene_.Add(std::move(std::get<FrameRecord>(item)));
  }

  void ScheduleTick() {
    if (std::exchange(is_scheduled_, true)) return;
    tick_.expires_at(last_tick_ + kInterval);
    tick_.async_wait([this](boost::system::error_code) { Tick(); });
  }

  void Tick() {
    is_scheduled_ = false;
    last_tick_ = Clock::now();
    TakeMail();
    AlignGroundtruth(false);
    service_->Broadcast();
    if (!farewell_) return;
    if (!service_->AllHaveFollowed() && Clock::now() < *farewell_) return ScheduleTick();
    server_.Drain([this] { io_.stop(); });
  }

  void AlignGroundtruth(bool now) {
    if (!options_.align_groundtruth || !scene_.map() || scene_.path().empty() ||
        scene_.path().version() == aligned_path_)
      return;
    if (!now && Clock::now() - last_alignment_ < kAlignInterval) return;
    last_alignment_ = Clock::now();
    aligned_path_ = scene_.path().version();
    std::vector<float> positions;
    for (const StampedPose& pose :
         options_.align_groundtruth(WorldPoses(*scene_.map(), scene_.path().poses()))) {
      const Eigen::Vector3f x = pose.world_from_cam.translation.cast<float>();
      positions.insert(positions.end(), x.data(), x.data() + 3);
    }
    if (!positions.empty()) scene_.SetGroundtruth(std::move(positions));
  }

  ViewerOptions options_;
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      io_.get_executor()};
  Scene scene_;
  std::shared_ptr<ViewerService> service_;
  boost::asio::steady_timer tick_;
  HttpServer server_;
  const std::string url_;
  bool is_scheduled_ = false;
  Clock::time_point last_tick_{}, last_alignment_{};
  uint64_t aligned_path_ = 0;
  std::optional<Clock::time_point> farewell_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Mail> mail_;  // in the order in which it came
  bool has_mail_ = false, is_down_ = false, has_refused_ = false;
  int waiting_edits_ = 0;
  std::vector<ViewerCommand> commands_;
  std::jthread thread_;
};

Viewer::Viewer(ViewerOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Viewer::~Viewer() = default;

std::string Viewer::url() const { return impl_->url(); }
void Viewer::Show(FrameRecord record) { impl_->Show(std::move(record)); }
void Viewer::ShowMap(std::shared_ptr<const Map> map, std::vector<FramePose> trajectory) {
  impl_->Edit([map = std::move(map), trajectory = std::move(trajectory)](Scene& scene) {
    scene.SetMap(map, trajectory);
  });
}
void Viewer::UpdateMap(std::shared_ptr<const Map> map) {
  impl_->Edit([map = std::move(map)](Scene& scene) { scene.UpdateMap(map); });
}
void Viewer::ShowNotes(std::vector<FrameNote> notes) {
  impl_->Edit([notes = std::move(notes)](Scene& scene) { scene.SetNotes(notes); });
}
void Viewer::ShowPicture(int frame_index, cv::Mat image) {
  impl_->EditBounded([frame_index, image = std::move(image)](Scene& scene) {
    scene.AddPicture(frame_index, image);
  });
}
void Viewer::ShowStatus(const SceneStatus& status) {
  impl_->Edit([status](Scene& scene) { scene.SetStatus(status); });
}
void Viewer::ShowEvent(int frame, const std::string& kind, const std::string& text) {
  impl_->Edit([=](Scene& scene) { scene.AddEvent(frame, kind, text); });
}
void Viewer::Clear() {
  impl_->Edit([](Scene& scene) { scene.Clear(); });
}
std::vector<ViewerCommand> Viewer::TakeCommands(int wait_ms) {
  return impl_->TakeCommands(wait_ms);
}
void Viewer::Shutdown() { impl_->Shutdown(); }

}  // namespace oaslam
