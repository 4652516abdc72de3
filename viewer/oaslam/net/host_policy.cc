#include "oaslam/net/host_policy.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>

#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// The host without the port; for "[::1]:80" the part inside the brackets. Empty for malformed text.
std::string NameOfHost(std::string_view host) {
  const bool bracketed = host.starts_with('[');
  const size_t end = bracketed ? host.find(']') : host.find(':');
  const std::string_view name = host.substr(
      bracketed ? 1 : 0, end == std::string_view::npos ? end : end - (bracketed ? 1 : 0));
  const std::string_view rest =
      end == std::string_view::npos ? std::string_view() : host.substr(end + (bracketed ? 1 : 0));
  if (bracketed && end == std::string_view::npos) return {};
  if (!rest.empty() &&
      (rest[0] != ':' || rest.size() > 6 ||
       !std::ranges::all_of(rest.substr(1), [](unsigned char c) { return std::isdigit(c); })))
    return {};
  return Lower(name);
}

}  // namespace

bool IsAllowedHost(std::string_view host, const std::vector<std::string>& names) {
  const std::string name = NameOfHost(host);
  if (name.empty()) return false;
  const auto is_name = [&](const std::string& allowed) { return name == Lower(allowed); };
  if (name == "localhost" || std::ranges::any_of(names, is_name)) return true;
  boost::system::error_code error;
  boost::asio::ip::make_address(name, error);
  return !error;
}

bool IsAllowedOrigin(std::string_view origin, std::string_view host) {
  if (origin.empty()) return true;
  // An origin leaves out the port of its scheme; some proxies add it to the host.
  const auto is_host_over = [&](std::string_view scheme, std::string_view port) {
    const std::string whole = std::string(scheme) + Lower(host), given = Lower(origin);
    return given == whole || given + std::string(port) == whole;
  };
  return is_host_over("http://", ":80") || is_host_over("https://", ":443");
}

}  // namespace oaslam
