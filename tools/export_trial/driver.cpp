#include <cmath>
#include <cstdlib>
#include <cstdio>
#include <fstream>
#include <iostream>
#include "torsio/export/c99.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
using namespace torsio;
int main(int n, char** a) {
  try {
    ModelFile m = load_model(a[1]); if (const char* z = getenv("ZERO")) m.settings.zeroed_channels.push_back(z);
    C99Options o{.name = "joint", .real = std::string(a[3]) == "float" ? CReal::single : CReal::twofold};
    for (int i = 5; i + 1 < n; i += 2) o.counts.push_back({a[i], std::stod(a[i + 1])});
    const C99Program p = c99_program(m, o, a[1]);
    std::ofstream(std::string(a[2]) + "/joint.h") << p.header;
    std::ofstream(std::string(a[2]) + "/joint.c") << p.source;
    Estimator e = make_estimator(m);
    for (const auto& z : m.settings.zeroed_channels) e.set_zero(z, 0.0);
    const auto recs = load_recordings({a[4]});
    const Recording& r = recs.front();
    std::ofstream raw(std::string(a[2]) + "/raw.bin", std::ios::binary), ref(std::string(a[2]) + "/ref.bin", std::ios::binary);
    std::vector<double> in(e.raw_inputs().size());
    double lo = 1e300, hi = -1e300;
    for (std::size_t k = 0; k < r.size(); ++k) {
      for (std::size_t i = 0; i < in.size(); ++i) {
        in[i] = r.channel(e.raw_inputs()[i]).values[k];
        if (o.real == CReal::single && o.counts.empty()) in[i] = static_cast<double>(static_cast<float>(in[i]));
        for (const auto& c : o.counts) if (c.channel == e.raw_inputs()[i]) in[i] = std::round(in[i] / (2 * M_PI / c.counts_per_turn)) * (2 * M_PI / c.counts_per_turn);
      }
      const std::size_t q = getenv("CALM") ? 0 : k % 20000;
      if (q == 1000 && o.counts.empty()) in[0] = NAN;                       // one
      if (q >= 1500 && q < 1505 && o.counts.empty()) in[0] = NAN;           // short gap
      if (q >= 2000 && q < 2200 && o.counts.empty()) in[0] = NAN;           // long gap
      if (q == 2800) in[0] += 1.0;                         // spike
      if (q >= 3300 && q < 3600) in[0] += 0.05 * std::sin((q - 3300) / 300.0 * M_PI);  // excursion
      if (q >= 4200 && q < 4300) in[0] += 0.02;            // level
      if (o.real == CReal::single && o.counts.empty()) in[0] = static_cast<double>(static_cast<float>(in[0]));
      for (const auto& c : o.counts) if (c.channel == e.raw_inputs()[0]) in[0] = std::round(in[0] / (2 * M_PI / c.counts_per_turn)) * (2 * M_PI / c.counts_per_turn);
      std::vector<double> w = in;
      for (std::size_t i = 0; i < in.size(); ++i) for (const auto& c : o.counts) if (c.channel == e.raw_inputs()[i]) w[i] = std::round(in[i] / (2 * M_PI / c.counts_per_turn));
      raw.write(reinterpret_cast<char*>(w.data()), 8 * (long)w.size());
      const Estimate x = e.step(in);
      const double row[3]{x.value, x.std_dev, double(int(x.fault))};
      ref.write(reinterpret_cast<const char*>(row), 24);
      lo = std::min(lo, x.value); hi = std::max(hi, x.value);
    }
    if (getenv("WORK")) { std::printf("WORK %zu %zu %zu", p.table_bytes, p.state_bytes, p.code_characters); for (double w : p.work) std::printf(" %g", w); std::printf("\n"); } std::printf("%zu inputs, %zu ticks, range %.4g, tables %zu\n", in.size(), r.size(), hi - lo, p.table_bytes);
    return (int)in.size();
  } catch (const std::exception& e) { std::cerr << e.what() << "\n"; return 99; }
}
