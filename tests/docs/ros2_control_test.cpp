// The controller on docs/robot/ros2_control.md, against declarations of our own in the place of ROS 2.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

TEST(Ros2Control, TheControllerCallsTorsioAsItIs) {
  const std::string page = test::file_bytes(TORSIO_SOURCE "/docs/robot/ros2_control.md");
  const std::string fence = "```cpp\n";
  const std::size_t begin = page.find(fence);
  ASSERT_NE(begin, std::string::npos);
  const std::size_t start = begin + fence.size();
  const TemporaryFolder folder;
  const std::string source =
      folder.file("torque_estimator.cpp", page.substr(start, page.find("```", start) - start));
  const std::string command = TORSIO_CXX
                              " -std=c++20 -Wall -Wextra -Werror -fsyntax-only -I" TORSIO_SOURCE
                              "/include -I" TORSIO_SOURCE "/tests/docs/ros2_stand_ins " +
                              source;
  EXPECT_EQ(std::system(command.c_str()), 0)
      << command;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
}

}  // namespace
}  // namespace torsio
