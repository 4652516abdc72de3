#include "oaslam/service/database_watch.h"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <memory>

#include "oaslam/service/map_store.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// A connection can break without a sign at this end: a query from time to time finds out.
constexpr int kQuestionEvery_ms = 5000;
// Between attempts to connect, doubled each time: a restart of the server is soon noticed, and one
// that is away for long is not flooded.
constexpr int kFirstPause_ms = 100, kLongestPause_ms = 2000;

}  // namespace

DatabaseWatch::DatabaseWatch(const PgLocation& location,
                             std::function<void(const std::string& map)> changed)
    : location_(location), changed_(std::move(changed)), end_(eventfd(0, EFD_CLOEXEC)) {
  OASLAM_CHECK(end_.get() >= 0);
  thread_ = std::thread([this, connection = Listen()]() mutable { Follow(std::move(connection)); });
}

DatabaseWatch::~DatabaseWatch() {
  eventfd_write(end_.get(), 1);
  thread_.join();
}

std::unique_ptr<PgConnection> DatabaseWatch::Listen() const {
  auto connection = std::make_unique<PgConnection>(location_, std::chrono::seconds(5));
  connection->Run(std::string("LISTEN ") + kChangesChannel);
  return connection;
}

bool DatabaseWatch::Wait(int milliseconds, const PgConnection* connection) const {
  pollfd files[] = {{end_.get(), POLLIN, 0}, {connection ? connection->socket() : -1, POLLIN, 0}};
  poll(files, 2, milliseconds);
  return files[0].revents == 0;
}

void DatabaseWatch::Follow(std::unique_ptr<PgConnection> connection) {
  int pause_ms = kFirstPause_ms;
  while (Wait(connection ? kQuestionEvery_ms : pause_ms, connection.get())) {
    try {
      if (!connection) {
        connection = Listen();
        pause_ms = kFirstPause_ms;
        changed_("");
      }
      std::vector<std::string> maps = connection->Notifications();
      if (maps.empty()) {
        connection->Run("SELECT 1");
        maps = connection->Notifications();  // what came before the answer
      }
      std::ranges::sort(maps);
      maps.erase(std::unique(maps.begin(), maps.end()), maps.end());
      for (const std::string& map : maps) changed_(map);
    } catch (const StoreUnavailable&) {
      connection.reset();
      pause_ms = std::min(2 * pause_ms, kLongestPause_ms);
    }
  }
}

}  // namespace oaslam
