// serve_joint SOCKET: the joint of the tests for programs in other languages, until its standard input ends.
#include <cstdio>

#include "link/served_joint.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string path = argv[1];
  const torsio::test::ServedJoint joint(torsio::open_unix({.path = path, .peer = path + ".host"}),
                                        {.watchdog_s = 2.0});
  while (std::getchar() != EOF) continue;
}
