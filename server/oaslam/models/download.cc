#include "oaslam/models/download.h"

#include <curl/curl.h>

#include <array>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>

#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// As many as curl's command line follows. A release of GitHub takes one.
constexpr long kMostRedirects = 50;

using Curl = std::unique_ptr<CURL, decltype(&curl_easy_cleanup)>;

Curl NewCurl() {
  static const CURLcode initialised = curl_global_init(CURL_GLOBAL_DEFAULT);
  Curl curl(initialised == CURLE_OK ? curl_easy_init() : nullptr, &curl_easy_cleanup);
  if (!curl) throw std::bad_alloc();
  return curl;
}

// One request, whose functions curl calls. No exception may cross curl, which is C.
struct Transfer {
  Curl curl = NewCurl();
  int64_t bytes = 0;  // of the file
  const DownloadOptions& options;
  std::string received{};
  std::exception_ptr failure{};

  template <typename Value>
  void Set(CURLoption option, Value value) {
    if (curl_easy_setopt(curl.get(), option, value) != CURLE_OK) throw std::bad_alloc();
  }

  template <typename Action>
  bool Guarded(const Action& action) {
    try {
      return action();
    } catch (const std::exception&) {
      failure = std::current_exception();
      return false;
    }
  }

  long Status() const {
    long status = 0;
    curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &status);
    return status;
  }

  bool Take(const char* data, size_t count) {
    constexpr long kOk = 200;
    if (Status() != kOk) throw BadInput("the server answers with status {}", Status());
    curl_off_t offered = -1;
    curl_easy_getinfo(curl.get(), CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &offered);
    if (offered >= 0 && offered != bytes)
      throw BadInput("the server has a file of {} bytes, the published one has {}", offered, bytes);
    if (received.size() + count > static_cast<size_t>(bytes))
      throw BadInput("the server sends more than the {} bytes of the published file", bytes);
    received.append(data, count);
    return true;
  }

  static size_t OnBytes(char* data, size_t, size_t count, void* self) {
    auto& transfer = *static_cast<Transfer*>(self);
    // Another number than `count` ends the transfer.
    return transfer.Guarded([&] { return transfer.Take(data, count); }) ? count : count + 1;
  }
  static int OnProgress(void* self, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    auto& transfer = *static_cast<Transfer*>(self);
    const auto come = static_cast<int64_t>(transfer.received.size());
    return transfer.Guarded([&] { return transfer.options.progress(come); }) ? 0 : 1;
  }
};

std::optional<std::string> Fetch(const std::string& url, int64_t bytes,
                                 const DownloadOptions& options) {
  Transfer transfer{.bytes = bytes, .options = options};
  std::array<char, CURL_ERROR_SIZE> error{};
  transfer.received.reserve(static_cast<size_t>(bytes));
  transfer.Set(CURLOPT_URL, url.c_str());
  transfer.Set(CURLOPT_PROTOCOLS_STR, "http,https");
  transfer.Set(CURLOPT_REDIR_PROTOCOLS_STR, url.starts_with("https://") ? "https" : "http,https");
  transfer.Set(CURLOPT_FOLLOWLOCATION, 1L);
  transfer.Set(CURLOPT_MAXREDIRS, kMostRedirects);
  transfer.Set(CURLOPT_FAILONERROR, 1L);
  transfer.Set(CURLOPT_NOSIGNAL, 1L);
  transfer.Set(CURLOPT_USERAGENT, "oaslam");
  transfer.Set(CURLOPT_CONNECTTIMEOUT, static_cast<long>(options.timeout_s));
  transfer.Set(CURLOPT_LOW_SPEED_LIMIT, 1L);
  transfer.Set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(options.timeout_s));
  transfer.Set(CURLOPT_ERRORBUFFER, error.data());
  // As OpenSSL's own programs do; the library alone knows only the system's authorities.
  if (const char* authorities = std::getenv("SSL_CERT_FILE"))
    transfer.Set(CURLOPT_CAINFO, authorities);
  transfer.Set(CURLOPT_WRITEFUNCTION, &Transfer::OnBytes);
  transfer.Set(CURLOPT_WRITEDATA, &transfer);
  transfer.Set(CURLOPT_NOPROGRESS, 0L);
  transfer.Set(CURLOPT_XFERINFOFUNCTION, &Transfer::OnProgress);
  transfer.Set(CURLOPT_XFERINFODATA, &transfer);

  const CURLcode code = curl_easy_perform(transfer.curl.get());
  if (transfer.failure) std::rethrow_exception(transfer.failure);
  if (code == CURLE_ABORTED_BY_CALLBACK) return std::nullopt;
  if (code == CURLE_HTTP_RETURNED_ERROR)
    throw BadInput("the server answers with status {}", transfer.Status());
  if (code != CURLE_OK || static_cast<int64_t>(transfer.received.size()) < bytes)
    throw BadInput("{}; `oaslam models add FILE` takes a file from elsewhere",
                   error[0] != '\0'   ? error.data()
                   : code != CURLE_OK ? curl_easy_strerror(code)
                                      : "the connection was closed");
  return std::move(transfer.received);
}

}  // namespace

std::optional<std::string> Download(const std::string& url, int64_t bytes,
                                    const DownloadOptions& options) {
  try {
    return Fetch(url, bytes, options);
  } catch (const InputError& error) {
    throw BadInput("{}: {}", WithoutPassword(url), error.what());
  }
}

}  // namespace oaslam
