#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>

#include "torsio/arm/contact_detector.hpp"
#include "torsio/arm/contacts_file.hpp"
#include "torsio/core/error.hpp"

// Any text is refused with an Error, or gives thresholds with which a detector can be made. With the first byte odd, the
// text is the joints and the numbers of an otherwise valid file.

namespace {

std::string text_of(const unsigned char* data, std::size_t size) {
  if (size == 0) return {};
  const std::string rest(data + 1, data + size);
  if (data[0] % 2 == 0) return rest;
  return R"({"format": "torsio contacts", "format_version": 1, "torsio_version": "0", "arm": "a",)" +
         rest + "}";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    const torsio::ContactsFile file = torsio::parse_contacts(text_of(data, size), "contacts.json");
    const torsio::ContactDetector detector(file.settings(), 500.0);
    if (!(file.hours > 0.0 && std::isfinite(file.hours))) std::abort();
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
