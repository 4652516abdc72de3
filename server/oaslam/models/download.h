#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "oaslam/models/part_file.h"
#include "oaslam/util/uri.h"

namespace oaslam {

struct DownloadOptions {
  // How long to wait for a connection, and for the next bytes.
  int timeout_s = 30;
  // Called about once a second or more often, with the number of bytes that are here; false stops
  // the download.
  std::function<bool(int64_t)> progress = [](int64_t) { return true; };
};

// Brings the rest of a file of `bytes` bytes over HTTP or HTTPS, and follows redirects, but none
// from HTTPS to HTTP. Goes on by itself after a break, as long as every attempt brings something.
// Returns false if `options.progress` does. Throws InputError where the server cannot be reached,
// does not have the file, or offers one of another size. In both cases the part keeps what has
// come, unless that cannot be the file's.
bool Download(const std::string& url, int64_t bytes, PartFile& part,
              const DownloadOptions& options);

}  // namespace oaslam
