#include "blas_threads.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>

void limit_blas_threads(char** argv) {
  constexpr const char* kVariable = "OPENBLAS_NUM_THREADS";
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  // main has started no thread yet.
  // NOLINTNEXTLINE(concurrency-mt-unsafe)
  if (std::getenv(kVariable) != nullptr || ::setenv(kVariable, "1", 0) != 0) return;
  ::execv("/proc/self/exe", argv);  // returns only if it fails, and then the program continues
}
