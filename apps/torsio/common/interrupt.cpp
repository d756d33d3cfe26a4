#include "common/interrupt.hpp"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <string_view>

#include "files/output_file.hpp"

namespace {

constexpr unsigned kDeadline_s = 1;

// Set by the handler of a signal, read by every thread that reports progress.
std::atomic<int> interrupted = 0;
static_assert(std::atomic<int>::is_always_lock_free);
std::atomic<int> is_terminal = 0;

void print_to_terminal(std::string_view text) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
}

// A factorisation of a large matrix, the search of a library or the wait for a device cannot ask
// for the signal. Only functions that POSIX allows in a signal handler are called here.
void end_at_once() {
  torsio::OutputFile::remove_unfinished();
  if (is_terminal != 0) print_to_terminal("\r\033[K");  // the progress bar
  print_to_terminal("torsio: stopped on request; no file is half-written\n");
  end_as_interrupted();
}

void on_interrupt(int signal) {
  if (interrupted != 0) return end_at_once();
  interrupted = signal;
  ::alarm(kDeadline_s);
}

void on_deadline(int /*signal*/) { end_at_once(); }

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  // Without SA_RESTART a signal also wakes a program that waits for a pipe. SA_NODEFER: the handler
  // ends the program by the signal that it handles.
  action.sa_flags = static_cast<int>(SA_NODEFER);
  (void)sigaction(signal, &action, nullptr);
}

}  // namespace

void catch_interrupts() {
  is_terminal = ::isatty(STDERR_FILENO);
  handle(SIGALRM, on_deadline);
  handle(SIGINT, on_interrupt);
  handle(SIGTERM, on_interrupt);
  // Without these two a write returns an error, which has a message.
  (void)std::signal(SIGPIPE, SIG_IGN);
  (void)std::signal(SIGXFSZ, SIG_IGN);
}

bool is_interrupted() noexcept { return interrupted != 0; }

void lift_interrupt_deadline() noexcept { ::alarm(0); }

void end_as_interrupted() {
  const int signal = interrupted;
  (void)std::signal(signal, SIG_DFL);
  (void)std::raise(signal);
}
