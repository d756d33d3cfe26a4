#include "torsio/store/store_address.hpp"

#include <algorithm>
#include <cstddef>

#include "torsio/core/error.hpp"

namespace torsio {

std::string StoreAddress::name() const {
  if (kind == Kind::memory) return "store in memory";
  if (kind == Kind::sqlite) return target;
  constexpr std::string_view kPassword = "password=";
  std::string shown = target;
  if (const std::size_t word = shown.find(kPassword, shown.find('?')); word != std::string::npos) {
    const std::size_t begin = word + kPassword.size();
    shown.erase(begin, std::min(shown.find('&', begin), shown.size()) - begin);
  }
  const std::size_t host = shown.find("://") + 3;
  const std::size_t at = shown.find('@', host);
  const std::size_t colon = shown.find(':', host);
  if (at != std::string::npos && colon < at) shown.erase(colon, at - colon);
  return shown;
}

StoreAddress store_address(std::string_view text) {
  if (text.starts_with("postgresql://") || text.starts_with("postgres://"))
    return {.kind = StoreAddress::Kind::postgresql, .target = std::string(text)};
  if (text.empty() || text.find("://") != std::string_view::npos)
    throw UsageError({.place = "--store",
                      .expected = "the path of a SQLite file, or a URL such as "
                                  "postgresql://user@host:5432/torsio",
                      .found = text.empty() ? "nothing" : '"' + std::string(text) + '"'});
  return {.kind = StoreAddress::Kind::sqlite, .target = std::string(text)};
}

}  // namespace torsio
