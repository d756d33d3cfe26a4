#include "interrupt.hpp"

#include <csignal>

namespace {

volatile std::sig_atomic_t interrupted = 0;

void on_interrupt(int signal_number) {
  interrupted = 1;
  (void)std::signal(signal_number, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  (void)std::signal(SIGINT, on_interrupt);
  (void)std::signal(SIGTERM, on_interrupt);
  (void)std::signal(SIGPIPE, SIG_IGN);  // a closed pipe becomes a write error with a message
}

bool is_interrupted() noexcept { return interrupted != 0; }
