#pragma once

#include <string>
#include <string_view>

namespace oaslam {

// Whether a request with this Host header may be answered: the host is an address, "localhost", or
// the name of this machine. A foreign name that was made to point here (DNS rebinding) is none of
// these.
bool IsAllowedHost(std::string_view host, const std::string& machine_name);

// Whether a page of this origin may open a connection: it came from the very host the request
// names. No origin: not a page.
bool IsAllowedOrigin(std::string_view origin, std::string_view host);

}  // namespace oaslam
