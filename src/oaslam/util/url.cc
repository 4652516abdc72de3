#include "oaslam/util/url.h"

namespace oaslam {

std::string WithoutPassword(const std::string& url) {
  const size_t host = url.find("://");
  if (host == std::string::npos) return url;
  const size_t begin = host + 3, end = url.find('/', begin), at = url.rfind('@', end);
  if (at == std::string::npos || at < begin) return url;
  return url.substr(0, begin) + url.substr(at + 1);
}

}  // namespace oaslam
