#include "oaslam/models/download.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <thread>

#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// A server that breaks off each time after a few bytes is given up.
constexpr int kMostAttempts = 20;
constexpr auto kPause = std::chrono::seconds(1);  // between two attempts
// As many as curl's command line follows. A release of GitHub takes one.
constexpr long kMostRedirects = 50;
constexpr long kOk = 200, kPartialContent = 206, kRangeNotSatisfiable = 416;

using Curl = std::unique_ptr<CURL, decltype(&curl_easy_cleanup)>;

Curl NewCurl() {
  static const CURLcode initialised = curl_global_init(CURL_GLOBAL_DEFAULT);
  Curl curl(initialised == CURLE_OK ? curl_easy_init() : nullptr, &curl_easy_cleanup);
  if (!curl) throw std::bad_alloc();
  return curl;
}

// One request for the bytes that the part does not have.
class Attempt {
 public:
  Attempt(const std::string& url, int64_t bytes, PartFile& part, const DownloadOptions& options)
      : curl_(NewCurl()), bytes_(bytes), begin_(part.size()), part_(part), options_(options) {
    const bool is_https = url.starts_with("https://");
    Set(CURLOPT_URL, url.c_str());
    Set(CURLOPT_PROTOCOLS_STR, "http,https");
    Set(CURLOPT_REDIR_PROTOCOLS_STR, is_https ? "https" : "http,https");
    Set(CURLOPT_FOLLOWLOCATION, 1L);
    Set(CURLOPT_MAXREDIRS, kMostRedirects);
    Set(CURLOPT_FAILONERROR, 1L);
    Set(CURLOPT_NOSIGNAL, 1L);
    Set(CURLOPT_USERAGENT, "oaslam");
    Set(CURLOPT_CONNECTTIMEOUT, static_cast<long>(options.timeout_s));
    Set(CURLOPT_LOW_SPEED_LIMIT, 1L);
    Set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(options.timeout_s));
    Set(CURLOPT_ERRORBUFFER, error_.data());
    // As OpenSSL's own programs do; the library alone knows only the system's authorities.
    if (const char* authorities = std::getenv("SSL_CERT_FILE")) Set(CURLOPT_CAINFO, authorities);
    if (begin_ > 0) {
      range_ = fmt::format("{}-", begin_);
      Set(CURLOPT_RANGE, range_.c_str());
    }
    Set(CURLOPT_WRITEFUNCTION, &Attempt::OnBytes);
    Set(CURLOPT_WRITEDATA, this);
    Set(CURLOPT_NOPROGRESS, 0L);
    Set(CURLOPT_XFERINFOFUNCTION, &Attempt::OnProgress);
    Set(CURLOPT_XFERINFODATA, this);
  }
  Attempt(const Attempt&) = delete;
  Attempt& operator=(const Attempt&) = delete;

  // Returns false if the download is to stop. Throws InputError where another attempt would be in
  // vain.
  bool Run() {
    const CURLcode code = curl_easy_perform(curl_.get());
    if (failure_) std::rethrow_exception(failure_);
    if (code == CURLE_ABORTED_BY_CALLBACK) return false;
    if (code == CURLE_HTTP_RETURNED_ERROR) {
      if (Status() == kRangeNotSatisfiable && begin_ > 0) {
        part_.Clear();
        return true;
      }
      problem_ = fmt::format("the server answers with status {}", Status());
    } else if (code != CURLE_OK) {
      problem_ = error_[0] != '\0' ? error_.data() : curl_easy_strerror(code);
    } else {
      problem_ = "the connection was closed";
    }
    return true;
  }

  // Why not all bytes have come; empty if the next attempt is to be made at once.
  const std::string& problem() const { return problem_; }

 private:
  template <typename Value>
  void Set(CURLoption option, Value value) {
    if (curl_easy_setopt(curl_.get(), option, value) != CURLE_OK) throw std::bad_alloc();
  }

  long Status() const {
    long status = 0;
    curl_easy_getinfo(curl_.get(), CURLINFO_RESPONSE_CODE, &status);
    return status;
  }

  // The size of the whole file, where the answer tells it.
  std::optional<int64_t> OfferedSize() const {
    if (Status() == kPartialContent) {
      curl_header* header = nullptr;
      long long first = 0, last = 0, total = 0;
      if (curl_easy_header(curl_.get(), "Content-Range", 0, CURLH_HEADER, -1, &header) !=
              CURLHE_OK ||
          std::sscanf(header->value, "bytes %lld-%lld/%lld", &first, &last, &total) < 2 ||
          first != begin_)
        throw InputError("the server answers with another part of the file");
      return total > 0 ? std::optional<int64_t>(total) : std::nullopt;
    }
    curl_off_t length = -1;
    curl_easy_getinfo(curl_.get(), CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
    return length >= 0 ? std::optional<int64_t>(length) : std::nullopt;
  }

  void BeginAnswer() {
    const long status = Status();
    if (status != kOk && status != kPartialContent)
      throw BadInput("the server answers with status {}", status);
    if (const auto size = OfferedSize(); size && *size != bytes_)
      throw BadInput("the server has a file of {} bytes, the published one has {}", *size, bytes_);
    if (status == kOk) part_.Clear();  // it knows no ranges
    is_begun_ = true;
  }

  void Take(const char* bytes, size_t count) {
    if (!is_begun_) BeginAnswer();
    if (part_.size() + static_cast<int64_t>(count) > bytes_) {
      part_.Clear();
      throw BadInput("the server sends more than the {} bytes of the published file", bytes_);
    }
    part_.Append(bytes, count);
  }

  // No exception may cross curl, which is C.
  static size_t OnBytes(char* bytes, size_t, size_t count, void* self) {
    auto& attempt = *static_cast<Attempt*>(self);
    try {
      attempt.Take(bytes, count);
      return count;
    } catch (const std::exception&) {
      attempt.failure_ = std::current_exception();
      return count + 1;  // another number than `count` ends the transfer
    }
  }
  static int OnProgress(void* self, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    auto& attempt = *static_cast<Attempt*>(self);
    try {
      return attempt.options_.progress(attempt.part_.size()) ? 0 : 1;
    } catch (const std::exception&) {
      attempt.failure_ = std::current_exception();
      return 1;
    }
  }

  Curl curl_;
  std::array<char, CURL_ERROR_SIZE> error_{};
  std::string range_, problem_;
  int64_t bytes_, begin_;
  PartFile& part_;
  const DownloadOptions& options_;
  bool is_begun_ = false;
  std::exception_ptr failure_;
};

bool Pause(const PartFile& part, const DownloadOptions& options) {
  const auto end = std::chrono::steady_clock::now() + kPause;
  while (std::chrono::steady_clock::now() < end) {
    if (!options.progress(part.size())) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

bool DownloadRest(const std::string& url, int64_t bytes, PartFile& part,
                  const DownloadOptions& options) {
  if (part.size() > bytes) part.Clear();
  for (int attempts = 1; part.size() < bytes; ++attempts) {
    const int64_t before = part.size();
    Attempt attempt(url, bytes, part, options);
    if (!attempt.Run()) return false;
    if (part.size() == bytes || attempt.problem().empty()) continue;
    if (part.size() <= before || attempts >= kMostAttempts)
      throw BadInput(
          "{}; {}", attempt.problem(),
          part.size() > 0
              ? fmt::format("{} of {} bytes are here, and the same command goes on from there",
                            part.size(), bytes)
              : "nothing was fetched; `oaslam models add FILE` takes a file from elsewhere");
    if (!Pause(part, options)) return false;
  }
  return true;
}

}  // namespace

bool Download(const std::string& url, int64_t bytes, PartFile& part,
              const DownloadOptions& options) {
  try {
    return DownloadRest(url, bytes, part, options);
  } catch (const InputError& error) {
    throw BadInput("{}: {}", WithoutPassword(url), error.what());
  }
}

}  // namespace oaslam
