#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

struct pg_conn;
struct pg_result;

namespace oaslam {

// A parameter of a statement: the text form of a value of PostgreSQL, or bytes.
struct PgParameter {
  std::string text;
  std::span<const std::byte> bytes{};
  bool is_binary = false;

  PgParameter(std::string value) : text(std::move(value)) {}
  PgParameter(const char* value) : text(value) {}
  PgParameter(int64_t value) : text(std::to_string(value)) {}
  PgParameter(double value);  // with as many digits as it takes to read the same value back
  PgParameter(std::span<const std::byte> value) : bytes(value), is_binary(true) {}
};

// The rows that a statement returns. Values of a statement that was sent as binary are bytes.
class PgRows {
 public:
  explicit PgRows(pg_result* result);
  int size() const;
  std::string_view Text(int row, int column) const;
  int64_t Integer(int row, int column) const;
  double Real(int row, int column) const;
  std::span<const std::byte> Bytes(int row, int column) const;

 private:
  std::shared_ptr<pg_result> result_;
};

// Where a database is, with the password that messages must not show.
struct PgLocation {
  std::string uri, password;

  // Throws InputError for what is no URI of PostgreSQL.
  explicit PgLocation(const std::string& uri);
};

// A connection to a PostgreSQL server, for one thread at a time. The functions throw
// StoreUnavailable where the server cannot be reached, does not answer in time or refuses, and
// InputError for values that it cannot keep.
class PgConnection {
 public:
  // `patience`: how long a statement may take.
  PgConnection(const PgLocation& location, std::chrono::milliseconds patience);

  PgRows Run(const std::string& sql, const std::vector<PgParameter>& parameters = {},
             bool is_binary = false);

  // False where the other end is known to be gone. Takes no time.
  bool IsUsable();
  // False within a transaction and after an error of the connection.
  bool IsIdle() const;

  int socket() const;
  // Takes what has arrived, and returns what was notified. Throws StoreUnavailable where the other
  // end is gone.
  std::vector<std::string> Notifications();

 private:
  [[noreturn]] void Fail(const std::string& problem) const;
  pg_result* Result(std::chrono::steady_clock::time_point deadline);
  void Wait(short events, std::chrono::steady_clock::time_point deadline);

  std::string password_;
  std::chrono::milliseconds patience_;
  bool is_given_up_ = false;  // an answer did not come in time
  std::shared_ptr<pg_conn> connection_;
};

// A transaction that ends with a rollback unless it was committed.
class PgTransaction {
 public:
  // `kind` follows BEGIN.
  explicit PgTransaction(PgConnection& connection, const std::string& kind = "");
  ~PgTransaction();
  PgTransaction(const PgTransaction&) = delete;
  PgTransaction& operator=(const PgTransaction&) = delete;
  void Commit();

 private:
  PgConnection& connection_;
  bool is_open_ = true;
};

// Connections for calls on several threads, at most `size` at a time. Thread-safe.
class PgPool {
 public:
  PgPool(PgLocation location, int size, std::chrono::milliseconds patience)
      : location_(std::move(location)), patience_(patience), free_(size) {}

  // Runs `act` with a connection. Throws StoreUnavailable where none is free for some seconds, and
  // at once where the last attempt to connect has just failed.
  template <typename Act>
  auto Use(Act act) {
    const Lease lease(*this);
    return act(*lease.connection);
  }

 private:
  struct Lease {
    explicit Lease(PgPool& pool);
    ~Lease();
    PgPool& pool;
    std::unique_ptr<PgConnection> connection;
  };

  const PgLocation location_;
  const std::chrono::milliseconds patience_;
  std::mutex mutex_;
  std::condition_variable returned_;
  int free_;  // connections that may be taken
  std::vector<std::unique_ptr<PgConnection>> idle_;
  std::chrono::steady_clock::time_point no_attempt_before_{};
  std::string last_problem_;
};

}  // namespace oaslam
