#include <cstdio>

#include "torsio/bench.hpp"
#include "torsio/data.hpp"
#include "torsio/design.hpp"
#include "torsio/learn.hpp"
#include "torsio/report.hpp"
#include "torsio/trials.hpp"
#ifdef TORSIO_HAS_ONNX
#include "torsio/core/error.hpp"
#include "torsio/import/onnx_network.hpp"
#endif

int main() {
  const torsio::FamilyInfo& family = torsio::find_family("dgmm");
  std::printf("%.*s\n", static_cast<int>(family.summary.size()), family.summary.data());
#ifdef TORSIO_HAS_ONNX
  try {
    (void)torsio::parse_onnx({}, "nothing");
    return 1;
  } catch (const torsio::Error& error) {
    std::printf("%s\n", error.what());
  }
#endif
}
