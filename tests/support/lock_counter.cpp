#include "support/lock_counter.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>

namespace {

thread_local std::size_t calls = 0;

/// glibc's function whose name is replaced here.
template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

#define TORSIO_COUNTED(name, parameters, arguments)        \
  int name parameters {                                    \
    static auto* const next = real<int parameters>(#name); \
    ++calls;                                               \
    return next arguments;                                 \
  }

extern "C" {
TORSIO_COUNTED(pthread_mutex_lock, (pthread_mutex_t * lock), (lock))
TORSIO_COUNTED(pthread_rwlock_rdlock, (pthread_rwlock_t * lock), (lock))
TORSIO_COUNTED(pthread_rwlock_wrlock, (pthread_rwlock_t * lock), (lock))
TORSIO_COUNTED(pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* lock),
               (condition, lock))
TORSIO_COUNTED(pthread_cond_signal, (pthread_cond_t * condition), (condition))
TORSIO_COUNTED(sem_wait, (sem_t * semaphore), (semaphore))
TORSIO_COUNTED(sem_post, (sem_t * semaphore), (semaphore))
}

#undef TORSIO_COUNTED

namespace torsio::test {

std::size_t lock_calls() noexcept { return calls; }

}  // namespace torsio::test
