#pragma once

#include <string>

#include "torsio/core/error.hpp"

namespace torsio::test {

/// What `work` complains of; empty if it does not.
template <class Work>
std::string error_message(Work&& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace torsio::test
