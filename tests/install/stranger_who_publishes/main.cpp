#include <array>
#include <cstdio>

#include "torsio/live.hpp"

int main() {
  torsio::TelemetryPublisher publisher(
      {.joints = {{.name = "elbow", .channels = {"torque_Nm"}}},
       .foxglove = torsio::TelemetryPublisher::Foxglove{.port = 0}});
  publisher.publish(0, 1'000'000, std::array{0.5F});
  std::printf("%d sample at port %d\n", static_cast<int>(publisher.counts().samples),
              publisher.foxglove_port());
}
