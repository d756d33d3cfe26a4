#include "numerics/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include "numerics/shared_progress.hpp"

namespace torsio {
namespace {

TEST(ForEachChunk, ThrowsTheErrorOfTheLowestChunk) {
  std::atomic<bool> has_thrown = false;
  std::string message;
  try {
    for_each_chunk(4, 2, [&](std::size_t chunk) {
      if (chunk == 0) {
        while (!has_thrown) std::this_thread::yield();
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      } else {
        has_thrown = true;
      }
      throw std::runtime_error("chunk " + std::to_string(chunk));
    });
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  EXPECT_EQ(message, "chunk 0") << "chunk 1 failed before";
}

TEST(ProgressOfParts, AddUpToThatOfTheWhole) {
  double last = 0.0;
  const Progress whole = [&last](double fraction, std::string_view) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return fraction < 0.7;
  };
  ProgressOfParts parts(whole, 4);
  const Progress first = parts.part(0);
  const Progress third = parts.part(2);
  EXPECT_TRUE(first(0.5, "reading"));
  EXPECT_TRUE(third(1.0, "reading"));
  EXPECT_DOUBLE_EQ(last, 0.375);
  EXPECT_TRUE(first(1.0, "reading"));
  EXPECT_FALSE(parts.part(3)(1.0, "reading")) << "the listener asks to stop";
  EXPECT_FALSE(ProgressOfParts(Progress(), 2).part(0));
}

}  // namespace
}  // namespace torsio
