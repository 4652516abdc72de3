#pragma once

#include <functional>
#include <string>
#include <thread>

#include "oaslam/service/postgres.h"
#include "oaslam/util/unique_fd.h"

namespace oaslam {

// The channel of PostgreSQL on which each change of a map is notified: with the map's name.
constexpr const char* kChangesChannel = "oaslam";

// Listens for changes on a connection and a thread of its own. Where the connection is lost it
// connects anew, and calls `changed` with an empty name then.
class DatabaseWatch {
 public:
  // Returns when it listens, so that what is notified from then on is not missed. Throws
  // StoreUnavailable where the database cannot be reached now.
  DatabaseWatch(const PgLocation& location, std::function<void(const std::string& map)> changed);
  ~DatabaseWatch();

 private:
  void Follow(std::unique_ptr<PgConnection> connection);
  std::unique_ptr<PgConnection> Listen() const;
  // False when this is to end. Returns early when the connection, if there is one, has something.
  bool Wait(int milliseconds, const PgConnection* connection) const;

  const PgLocation location_;
  const std::function<void(const std::string& map)> changed_;
  UniqueFd end_;  // readable when this is to end
  std::thread thread_;
};

}  // namespace oaslam
