#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

namespace seastitch::bench {

// Mixes 64 bits (the finalizer of SplitMix64; Steele, Lea, Flood, OOPSLA 2014).
constexpr std::uint64_t MixBits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

// Random numbers that are equal on every machine (unlike the distributions of <random>). Each use
// has its own stream, so that an additional number in one place changes no other.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view stream) : state_(MixBits(seed)) {
    for (const char c : stream) state_ = MixBits(state_ ^ static_cast<unsigned char>(c));
  }

  std::uint64_t Bits() {
    state_ += 0x9E3779B97F4A7C15u;
    return MixBits(state_);
  }
  // In [0, 1).
  double Uniform() { return static_cast<double>(Bits() >> 11) * 0x1p-53; }
  bool Chance(double probability) { return Uniform() < probability; }
  // Mean 0, sigma 1 (polar method).
  double Normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    double u = 0.0;
    double v = 0.0;
    double s = 0.0;
    do {
      u = 2.0 * Uniform() - 1.0;
      v = 2.0 * Uniform() - 1.0;
      s = u * u + v * v;
    } while (s >= 1.0 || s == 0.0);
    const double scale = std::sqrt(-2.0 * std::log(s) / s);
    spare_ = v * scale;
    has_spare_ = true;
    return u * scale;
  }

 private:
  std::uint64_t state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

// First-order Gauss-Markov error with standard deviation `sigma` and correlation time `tau_s`.
class CorrelatedError {
 public:
  CorrelatedError(double sigma, double tau_s, Random* random)
      : sigma_(sigma), tau_s_(tau_s), value_(sigma * random->Normal()) {}

  double value() const { return value_; }
  void Step(double dt_s, Random* random) {
    const double keep = std::exp(-dt_s / tau_s_);
    value_ = keep * value_ + sigma_ * std::sqrt(1.0 - keep * keep) * random->Normal();
  }

 private:
  double sigma_;
  double tau_s_;
  double value_;
};

}  // namespace seastitch::bench
