#pragma once

#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// Whether a value of the header `Host` is localhost, an address in numbers, or one of these names, with any port. No page can
/// make a browser send these but by their own names, whereas it can make a name of its own lead here.
[[nodiscard]] bool is_allowed_host(std::string_view host, std::span<const std::string> names);

/// Whether a page of this origin may open a WebSocket that was reached as `host`: one of the same server, without an origin,
/// or on the list, in which "*" is each and "http://localhost:*" each port of it.
[[nodiscard]] bool is_allowed_origin(std::string_view origin, std::string_view host,
                                     std::span<const std::string> allowed);

}  // namespace torsio
