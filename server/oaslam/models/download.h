#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "oaslam/util/uri.h"

namespace oaslam {

struct DownloadOptions {
  // How long to wait for a connection, and for the next bytes.
  int timeout_s = 30;
  // Called about once a second or more often, with the number of bytes that have come; false stops
  // the download.
  std::function<bool(int64_t)> progress = [](int64_t) { return true; };
};

// Fetches a file of `bytes` bytes over HTTP or HTTPS, and follows redirects, but none from HTTPS to
// HTTP. Returns its bytes; nothing if `options.progress` stopped it. Throws InputError where the
// server cannot be reached, breaks off, does not have the file, or offers one of another size.
std::optional<std::string> Download(const std::string& url, int64_t bytes,
                                    const DownloadOptions& options);

}  // namespace oaslam
