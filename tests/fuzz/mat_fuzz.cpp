#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "data/arrays/mat.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

/// libmatio asks for as much memory as a damaged file claims, and expects null.
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

/// Any bytes, and any damaged MATLAB file, are columns or an Error within the budget: the library that reads them works in
/// a child process, whose end by a signal is an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("fuzz.mat", 0);
  if (file < 0) return 0;
  if (write(file, data, size) == static_cast<ssize_t>(size)) {
    torsio::fuzz::within_budget([&] {
      try {
        static_cast<void>(torsio::table_of_arrays(
            torsio::read_mat("/proc/self/fd/" + std::to_string(file)), "fuzz.mat", {}));
      } catch (const torsio::Error&) {
        return;
      }
    });
  }
  close(file);
  return 0;
}
