#include "interrupt.hpp"

#include <csignal>

namespace {

volatile std::sig_atomic_t interrupted = 0;

void on_interrupt(int signal) { interrupted = signal; }

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  // Without SA_RESTART a signal also wakes a program that waits for a pipe.
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  (void)sigaction(SIGINT, &action, nullptr);
  (void)sigaction(SIGTERM, &action, nullptr);
  (void)std::signal(SIGPIPE, SIG_IGN);  // a closed pipe becomes a write error with a message
}

bool is_interrupted() noexcept { return interrupted != 0; }

void end_as_interrupted() {
  const int signal = interrupted;
  (void)std::signal(signal, SIG_DFL);
  (void)std::raise(signal);
}
