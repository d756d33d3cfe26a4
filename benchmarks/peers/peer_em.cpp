// One EM iteration of Armadillo's gmm_full on the samples of torsio_bench, one thread.
//
// Usage: peer_em FOLDER; prints microseconds.

#include <armadillo>
#include <chrono>
#include <cstdio>
#include <string>

namespace {

arma::mat read(const std::string& file, arma::uword rows) {
  arma::vec values;
  if (!values.load(file, arma::raw_binary)) throw std::runtime_error(file + ": cannot be read");
  return arma::reshape(values, rows, values.n_elem / rows);
}

double learn_seconds(const arma::gmm_full& start, const arma::mat& samples,
                     arma::uword iterations) {
  double best = 1e300;
  for (int run = 0; run < 3; ++run) {
    arma::gmm_full model = start;
    const auto begin = std::chrono::steady_clock::now();
    if (!model.learn(samples, start.n_gaus(), arma::maha_dist, arma::keep_existing, 0, iterations,
                     1e-10, false))
      throw std::runtime_error("Armadillo could not learn");
    const std::chrono::duration<double> span = std::chrono::steady_clock::now() - begin;
    best = std::min(best, span.count());
  }
  return best;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: peer_em FOLDER");
  const std::string folder = std::string(argv[1]) + "/";
  constexpr arma::uword kDimension = 4;
  const arma::mat samples = read(folder + "em_samples.f64", kDimension);
  const arma::mat means = read(folder + "em_means.f64", kDimension);
  const arma::mat flat = read(folder + "em_covariances.f64", kDimension * kDimension);
  const arma::mat weights = read(folder + "em_weights.f64", means.n_cols);
  arma::cube covariances(kDimension, kDimension, means.n_cols);
  for (arma::uword i = 0; i < means.n_cols; ++i)
    covariances.slice(i) = arma::reshape(flat.col(i), kDimension, kDimension);
  arma::gmm_full start;
  start.set_params(means, covariances, weights.t());
  // What learn() does besides iterating cancels.
  const double seconds =
      (learn_seconds(start, samples, 4) - learn_seconds(start, samples, 1)) / 3.0;
  std::printf("%.6g\n", seconds * 1e6);
} catch (const std::exception& error) {
  std::fprintf(stderr, "peer_em: %s\n", error.what());
  return 1;
}
