#include "oaslam/service/postgres.h"

#include <fmt/format.h>
#include <libpq-fe.h>
#include <poll.h>

#include <charconv>

#include "oaslam/error.h"
#include "oaslam/service/map_store.h"

namespace oaslam {
namespace {

// As long as a statement of a call may take: then a connection should be free again.
constexpr std::chrono::seconds kWaitForConnection{5};
// Between two attempts to connect, so that not every request waits for a server that is away.
constexpr std::chrono::milliseconds kPauseAfterFailure{300};

template <typename Number>
Number Parse(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw StoreUnavailable("database: \"" + std::string(text) + "\" where a number should be");
  return value;
}

// The first line of a message of libpq, without the password.
std::string Readable(std::string message, const std::string& password) {
  message = message.substr(0, message.find('\n'));
  for (size_t at; !password.empty() && (at = message.find(password)) != std::string::npos;)
    message.replace(at, password.size(), "");
  return "database: " + message;
}

}  // namespace

PgParameter::PgParameter(double value) : text(fmt::format("{}", value)) {}

PgRows::PgRows(pg_result* result) : result_(result, PQclear) {}

int PgRows::size() const { return PQntuples(result_.get()); }

std::string_view PgRows::Text(int row, int column) const {
  return {PQgetvalue(result_.get(), row, column),
          static_cast<size_t>(PQgetlength(result_.get(), row, column))};
}

int64_t PgRows::Integer(int row, int column) const { return Parse<int64_t>(Text(row, column)); }

double PgRows::Real(int row, int column) const { return Parse<double>(Text(row, column)); }

std::span<const std::byte> PgRows::Bytes(int row, int column) const {
  return std::as_bytes(std::span(Text(row, column)));
}

PgLocation::PgLocation(const std::string& location) : uri(location) {
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> options(
      PQconninfoParse(uri.c_str(), nullptr), &PQconninfoFree);
  // The message does not quote the location, which contains the password.
  if (!options)
    throw InputError(
        "database: the location must have the form "
        "postgresql://user:password@host:port/database?option=value");
  for (const PQconninfoOption* option = options.get(); option->keyword; ++option)
    if (option->val && std::string_view(option->keyword) == "password") password = option->val;
}

PgConnection::PgConnection(const PgLocation& location, std::chrono::milliseconds patience)
    : password_(location.password), patience_(patience) {
  // The location comes last, so that options in it override the defaults before it.
  const char* const keywords[] = {"connect_timeout",  "keepalives_idle",  "keepalives_interval",
                                  "keepalives_count", "tcp_user_timeout", "application_name",
                                  "client_encoding",  "dbname",           nullptr};
  const char* const values[] = {
      "3", "5", "2", "3", "10000", "oaslam", "UTF8", location.uri.c_str(), nullptr};
  connection_.reset(PQconnectdbParams(keywords, values, 1), PQfinish);
  if (!connection_ || PQstatus(connection_.get()) != CONNECTION_OK)
    Fail(connection_ ? PQerrorMessage(connection_.get()) : "no memory");
  PQsetNoticeProcessor(
      connection_.get(), [](void*, const char*) {}, nullptr);
  PQsetnonblocking(connection_.get(), 1);
  // The server itself ends statements that take longer than this end waits.
  Run(
      fmt::format("SET statement_timeout = {0}; SET lock_timeout = {0}; "
                  "SET idle_in_transaction_session_timeout = {1}",
                  patience.count(), 2 * patience.count()));
}

void PgConnection::Fail(const std::string& problem) const {
  throw StoreUnavailable(Readable(problem, password_));
}

void PgConnection::Wait(short events, std::chrono::steady_clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
      deadline - std::chrono::steady_clock::now());
  pollfd file{socket(), events, 0};
  if (left.count() > 0 && poll(&file, 1, static_cast<int>(left.count()) + 1) != 0) return;
  is_given_up_ = true;
  Fail("the server does not answer");
}

// The result of the statement that was sent; of several statements, that of the last.
pg_result* PgConnection::Result(std::chrono::steady_clock::time_point deadline) {
  PGconn* const connection = connection_.get();
  while (PQflush(connection) == 1) {
    Wait(POLLIN | POLLOUT, deadline);
    PQconsumeInput(connection);
  }
  pg_result* result = nullptr;
  for (;;) {
    while (PQisBusy(connection)) {
      try {
        Wait(POLLIN, deadline);
      } catch (const StoreUnavailable&) {
        PQclear(result);
        throw;
      }
      if (!PQconsumeInput(connection)) break;
    }
    pg_result* const next = PQgetResult(connection);
    if (!next) return result;
    PQclear(result);
    result = next;
  }
}

PgRows PgConnection::Run(const std::string& sql, const std::vector<PgParameter>& parameters,
                         bool is_binary) {
  std::vector<const char*> values;
  std::vector<int> lengths, formats;
  for (const PgParameter& p : parameters) {
    values.push_back(p.is_binary ? reinterpret_cast<const char*>(p.bytes.data()) : p.text.c_str());
    lengths.push_back(static_cast<int>(p.bytes.size()));
    formats.push_back(p.is_binary ? 1 : 0);
  }
  const auto deadline = std::chrono::steady_clock::now() + patience_;
  // PQsendQueryParams takes one statement only, PQsendQuery several.
  const bool is_sent =
      values.empty() && !is_binary
          ? PQsendQuery(connection_.get(), sql.c_str())
          : PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()),
                              nullptr, values.data(), lengths.data(), formats.data(),
                              is_binary ? 1 : 0);
  if (!is_sent) Fail(PQerrorMessage(connection_.get()));
  PGresult* const result = Result(deadline);
  PgRows rows(result);
  const ExecStatusType status = PQresultStatus(result);
  if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) return rows;
  const char* const state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const char* const message = PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  const std::string problem = message ? message : PQerrorMessage(connection_.get());
  // Class 22: a value that a column cannot hold.
  if (state && std::string_view(state).starts_with("22"))
    throw InputError(Readable(problem, password_));
  Fail(problem);
}

bool PgConnection::IsUsable() {
  // An idle connection receives nothing, but for the end of the connection and the error message
  // that may precede it: a readable socket is read twice, once for each.
  pollfd readable{socket(), POLLIN, 0};
  if (poll(&readable, 1, 0) > 0) PQconsumeInput(connection_.get());
  if (poll(&readable, 1, 0) > 0) PQconsumeInput(connection_.get());
  return IsIdle();
}

bool PgConnection::IsIdle() const {
  return !is_given_up_ && PQstatus(connection_.get()) == CONNECTION_OK &&
         PQtransactionStatus(connection_.get()) == PQTRANS_IDLE;
}

int PgConnection::socket() const { return PQsocket(connection_.get()); }

std::vector<std::string> PgConnection::Notifications() {
  if (!PQconsumeInput(connection_.get())) Fail(PQerrorMessage(connection_.get()));
  std::vector<std::string> found;
  while (PGnotify* const notified = PQnotifies(connection_.get())) {
    found.emplace_back(notified->extra);
    PQfreemem(notified);
  }
  return found;
}

PgTransaction::PgTransaction(PgConnection& connection, const std::string& kind)
    : connection_(connection) {
  connection_.Run("BEGIN " + kind);
}

PgTransaction::~PgTransaction() {
  if (!is_open_) return;
  try {
    connection_.Run("ROLLBACK");
  } catch (const std::runtime_error&) {
    // The server has rolled back already, or will when it notices that the connection is gone.
  }
}

void PgTransaction::Commit() {
  is_open_ = false;
  connection_.Run("COMMIT");
}

PgPool::Lease::Lease(PgPool& owner) : pool(owner) {
  std::unique_lock lock(pool.mutex_);
  if (!pool.returned_.wait_for(lock, kWaitForConnection, [this] { return pool.free_ > 0; }))
    throw StoreUnavailable("database: all connections are in use");
  --pool.free_;
  while (!connection && !pool.idle_.empty()) {
    connection = std::move(pool.idle_.back());
    pool.idle_.pop_back();
    if (!connection->IsUsable()) connection.reset();
  }
  if (connection) return;
  try {
    if (std::chrono::steady_clock::now() < pool.no_attempt_before_)
      throw StoreUnavailable(pool.last_problem_);
    lock.unlock();
    connection = std::make_unique<PgConnection>(pool.location_, pool.patience_);
  } catch (const StoreUnavailable& error) {
    if (!lock.owns_lock()) {
      lock.lock();
      pool.no_attempt_before_ = std::chrono::steady_clock::now() + kPauseAfterFailure;
      pool.last_problem_ = error.what();
    }
    ++pool.free_;
    pool.returned_.notify_one();
    throw;
  }
}

PgPool::Lease::~Lease() {
  const std::scoped_lock lock(pool.mutex_);
  if (connection->IsIdle()) pool.idle_.push_back(std::move(connection));
  ++pool.free_;
  pool.returned_.notify_one();
}

}  // namespace oaslam
