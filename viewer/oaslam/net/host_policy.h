#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// Whether a request with this Host header may be answered: the host must be an address,
// "localhost", or one of the names given. This rejects foreign names that were made to point here
// (DNS rebinding).
bool IsAllowedHost(std::string_view host, const std::vector<std::string>& names);

// Whether a page of this origin may open a connection: it must come from the host that the request
// names, over http or https. Requests without origin do not come from a page and are allowed.
bool IsAllowedOrigin(std::string_view origin, std::string_view host);

}  // namespace oaslam
