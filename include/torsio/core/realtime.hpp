#pragma once

/// Marks a function that never allocates, locks, throws or does I/O. Compilers that can check it do
/// (clang 20 on); elsewhere the counting allocator of tests/realtime is the proof.
#if defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define TORSIO_REALTIME [[clang::nonblocking]]
#endif
#endif
#ifndef TORSIO_REALTIME
#define TORSIO_REALTIME
#endif

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "torsio must see NaN: compile without -ffast-math, -Ofast and -ffinite-math-only"
#endif

namespace torsio {

/// Turns denormal numbers off on this thread while it lives: decaying filters otherwise end in
/// arithmetic that is tens of times slower. Put one at the top of each real-time thread.
class DenormalsOff {
 public:
  DenormalsOff() noexcept;
  ~DenormalsOff();
  DenormalsOff(const DenormalsOff&) = delete;
  DenormalsOff& operator=(const DenormalsOff&) = delete;

 private:
  unsigned int saved_ = 0;
};

}  // namespace torsio
