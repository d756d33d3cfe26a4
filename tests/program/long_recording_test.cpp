// The memory of a fit to many samples.
#include <sys/resource.h>

#include <cstddef>
#include <cstdlib>

#include "program/program.hpp"

namespace torsio::test {
namespace {

/// The largest resident memory of a program that has run so far.
double peak_bytes() {
  rusage used{};
  EXPECT_EQ(getrusage(RUSAGE_CHILDREN, &used), 0);
  return 1024.0 * static_cast<double>(used.ru_maxrss);
}

class LongRecordings : public Program {};

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
TEST_F(LongRecordings, DISABLED_AGreyBoxTakesFewBytesForEachSample) {
#else
TEST_F(LongRecordings, AGreyBoxTakesFewBytesForEachSample) {
#endif
  constexpr double kSamples = 100e3;  // in each recording
  ASSERT_EQ(shell("for i in 1 2 3 4 5 6; do {torsio} simulate dfki-50 sweep --duration 100s "
                  "--seed $i -o r$i.csv || exit 1; done")
                .exit_code,
            0);
  // Every array of samples is a mapping of its own and goes back when it is freed. Without this the
  // peak depends on the order of the allocations: 154 to 174 bytes for each sample.
  ASSERT_EQ(setenv("MALLOC_MMAP_THRESHOLD_", "500000", 1), 0);
  const auto fit = [this](const char* files) {
    const Outcome outcome =
        torsio(std::string("fit ") + files + " --model grey_box -o m.safetensors");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return peak_bytes();
  };
  const double two = fit("r1.csv r2.csv");
  const double six = fit("r1.csv r2.csv r3.csv r4.csv r5.csv r6.csv");
  // 14.4 million samples in 2.5 GB; inputs and target alone are 32 bytes.
  EXPECT_LT((six - two) / (4.0 * kSamples), 174.0) << two << " and " << six << " bytes";
  EXPECT_GT(six, two);
}

}  // namespace
}  // namespace torsio::test
