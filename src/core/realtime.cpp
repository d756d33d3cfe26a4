#include "torsio/core/realtime.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <cstdint>
#endif

namespace torsio {

#if defined(__SSE2__)
namespace {
constexpr unsigned int kFlushToZero = 0x8000;
constexpr unsigned int kDenormalsAreZero = 0x0040;
}  // namespace

DenormalsOff::DenormalsOff() noexcept : saved_(_mm_getcsr()) {
  _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero);
}
DenormalsOff::~DenormalsOff() { _mm_setcsr(saved_); }
#elif defined(__aarch64__)
DenormalsOff::DenormalsOff() noexcept {
  std::uint64_t control = 0;
  asm volatile("mrs %0, fpcr" : "=r"(control));
  saved_ = static_cast<unsigned int>(control);
  asm volatile("msr fpcr, %0" ::"r"(control | (1ULL << 24)));
}
DenormalsOff::~DenormalsOff() {
  asm volatile("msr fpcr, %0" ::"r"(static_cast<std::uint64_t>(saved_)));
}
#else
DenormalsOff::DenormalsOff() noexcept = default;
DenormalsOff::~DenormalsOff() = default;
#endif

}  // namespace torsio
