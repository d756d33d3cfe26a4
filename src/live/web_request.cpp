#include "live/web_request.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace torsio {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char character) {
    return static_cast<char>(std::tolower(character));
  });
  return result;
}

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 &&
         std::ranges::all_of(text,
                             [](unsigned char character) { return std::isdigit(character) != 0; });
}

/// The host without its port; empty: it is not a host.
std::string name_of(std::string_view host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return {};
    const std::string_view rest = host.substr(end + 1);
    if (!rest.empty() && (rest[0] != ':' || !is_port(rest.substr(1)))) return {};
    return std::string(host.substr(1, end - 1));
  }
  const std::size_t colon = host.find(':');
  if (colon == std::string_view::npos) return lower(host);
  if (!is_port(host.substr(colon + 1))) return {};
  return lower(host.substr(0, colon));
}

bool is_address(const std::string& name) {
  std::array<unsigned char, 16> bytes{};
  return ::inet_pton(AF_INET, name.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, name.c_str(), bytes.data()) == 1;
}

}  // namespace

bool is_allowed_host(std::string_view host, std::span<const std::string> names) {
  const std::string name = name_of(host);
  if (name.empty()) return false;
  return name == "localhost" || is_address(name) ||
         std::ranges::any_of(names, [&](const std::string& each) { return lower(each) == name; });
}

bool is_allowed_origin(std::string_view origin, std::string_view host,
                       std::span<const std::string> allowed) {
  if (origin.empty()) return true;
  const std::string page = lower(origin);
  if (page == "http://" + lower(host)) return true;
  return std::ranges::any_of(allowed, [&](const std::string& each) {
    if (each == "*" || lower(each) == page) return true;
    if (!each.ends_with(":*")) return false;
    const std::string without_port = lower(std::string_view(each).substr(0, each.size() - 1));
    return page.starts_with(without_port) &&
           is_port(std::string_view(page).substr(without_port.size()));
  });
}

}  // namespace torsio
