#include "mapper/registration/correlator.hpp"

#include <fftw3.h>

#include <algorithm>
#include <mutex>
#include <new>

namespace seastitch {
namespace {

// Smallest 4, 5 or 6 times a power of two. These sizes transform fast. They are few, because FFTW
// needs longer for its first plan of a size than for a transform, and keeps the plan.
int FastSize(int at_least) {
  for (int power = 2;; power *= 2)
    for (const int factor : {4, 5, 6})
      if (factor * power >= at_least) return factor * power;
}

// Guards FFTW's planner: its tables are the only part of FFTW that threads must not share.
std::mutex& PlannerMutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

struct Correlator::Plans {
  Plans(int rows, int cols, int lag_rows)
      : real_size(static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols)),
        spectrum_size(static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols / 2 + 1)),
        real(fftw_alloc_real(real_size)),
        spectrum(fftw_alloc_complex(spectrum_size)) {
    const std::lock_guard lock(PlannerMutex());
    // FFTW_ESTIMATE makes the same plan in every run, and so the same bits: it measures no times.
    forward = fftw_plan_dft_r2c_2d(rows, cols, real, spectrum, FFTW_ESTIMATE);
    // Inverse transform by columns, then only of the rows that are needed.
    const int bins = cols / 2 + 1;
    columns_back = fftw_plan_many_dft(1,
                                      &rows,
                                      bins,
                                      spectrum,
                                      nullptr,
                                      bins,
                                      1,
                                      spectrum,
                                      nullptr,
                                      bins,
                                      1,
                                      FFTW_BACKWARD,
                                      FFTW_ESTIMATE);
    rows_back = fftw_plan_many_dft_c2r(
        1, &cols, lag_rows, spectrum, nullptr, 1, bins, real, nullptr, 1, cols, FFTW_ESTIMATE);
  }
  ~Plans() {
    const std::lock_guard lock(PlannerMutex());
    fftw_destroy_plan(forward);
    fftw_destroy_plan(columns_back);
    fftw_destroy_plan(rows_back);
    fftw_free(spectrum);
    fftw_free(real);
  }
  Plans(const Plans&) = delete;
  Plans& operator=(const Plans&) = delete;

  std::size_t real_size;
  std::size_t spectrum_size;
  double* real;
  fftw_complex* spectrum;
  fftw_plan forward;
  fftw_plan columns_back;
  fftw_plan rows_back;
};

Correlator::Correlator(int min_rows, int min_cols, int lag_rows)
    : rows_(FastSize(min_rows)),
      cols_(FastSize(min_cols)),
      plans_(std::make_unique<Plans>(rows_, cols_, std::min(lag_rows, rows_))) {}

Correlator::~Correlator() = default;

Correlator::Spectrum Correlator::Transform(const std::vector<double>& image) {
  std::copy_n(image.begin(), plans_->real_size, plans_->real);
  fftw_execute(plans_->forward);
  const auto* begin = reinterpret_cast<const std::complex<double>*>(plans_->spectrum);
  return Spectrum(begin, begin + plans_->spectrum_size);
}

void Correlator::Multiply(const Spectrum& a, const Spectrum& b, bool add) {
  const double scale = 1.0 / static_cast<double>(plans_->real_size);
  for (std::size_t i = 0; i < plans_->spectrum_size; ++i) {
    // Complex product written out: that of std::complex checks for infinities first.
    const double re = (a[i].real() * b[i].real() + a[i].imag() * b[i].imag()) * scale;
    const double im = (a[i].real() * b[i].imag() - a[i].imag() * b[i].real()) * scale;
    plans_->spectrum[i][0] = add ? plans_->spectrum[i][0] + re : re;
    plans_->spectrum[i][1] = add ? plans_->spectrum[i][1] + im : im;
  }
}

const double* Correlator::Invert() {
  fftw_execute(plans_->columns_back);
  fftw_execute(plans_->rows_back);
  return plans_->real;
}

const double* Correlator::Correlate(const Spectrum& a, const Spectrum& b) {
  Multiply(a, b, false);
  return Invert();
}

const double* Correlator::Correlate(const Spectrum& a1,
                                    const Spectrum& b1,
                                    const Spectrum& a2,
                                    const Spectrum& b2) {
  Multiply(a1, b1, false);
  Multiply(a2, b2, true);
  return Invert();
}

}  // namespace seastitch
