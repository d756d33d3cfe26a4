// The rows of the link's codec, measured with a codec that is compiled without instructions of one processor.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "rows.hpp"

int main() {
  using namespace torsio::bench;
  const auto print = [](const char* name, const Row& row) {
    fmt::print("{:<26} {:>10.5g} {:<8} without SSE2 and carry-less products\n", name, row.value,
               row.unit);
  };
  try {
    print("link_encode", link_encode());
    print("link_encode_escapes", link_encode_escapes());
    print("link_decode", link_decode());
    print("link_decode_escapes", link_decode_escapes());
  } catch (const std::exception& error) {
    fmt::print(stderr, "portable_link: {}\n", error.what());
    return 2;
  }
}
