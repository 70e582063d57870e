#pragma once

#include <complex>
#include <limits>
#include <memory>
#include <vector>

namespace seastitch {

// Cross-correlation of real images of one size through the Fourier transform, on one thread.
class Correlator {
 public:
  using Spectrum = std::vector<std::complex<double>>;

  // Rounds rows and cols up to sizes that transform fast. Lags are wanted of the first lag_rows
  // rows, or of all.
  Correlator(int min_rows, int min_cols, int lag_rows = std::numeric_limits<int>::max());
  ~Correlator();
  Correlator(const Correlator&) = delete;
  Correlator& operator=(const Correlator&) = delete;

  int rows() const { return rows_; }
  int cols() const { return cols_; }

  // image: rows() x cols(), row by row.
  Spectrum Transform(const std::vector<double>& image);
  // sum over p of a(p) b(p + lag), for lags from 0 up: lag_rows x cols(), row by row; a and b wrap
  // around. Valid until the next call.
  const double* Correlate(const Spectrum& a, const Spectrum& b);
  // The same of several pairs, added up.
  const double* Correlate(const Spectrum& a1,
                          const Spectrum& b1,
                          const Spectrum& a2,
                          const Spectrum& b2);

 private:
  struct Plans;
  const double* Invert();
  void Multiply(const Spectrum& a, const Spectrum& b, bool add);

  int rows_;
  int cols_;
  std::unique_ptr<Plans> plans_;
};

}  // namespace seastitch
