#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/core/time.hpp"

namespace seastitch {

// Record of a sensor's refused samples.
class RefusalRecord {
 public:
  void Add(Time t, bool refused);
  // Adds a sample that was refused before the filter: it counts in the share, not in the streak. Up
  // to some seconds out of order.
  void AddUnusable(Time t);
  // Fraction refused in the minute before `now`, 0 to 1; 0 without a sample.
  double Share(Time now) const;
  // Since when the share has been above a tenth, if it is at `now`.
  std::optional<Time> Since(Time now) const;
  // Seconds for which every sample has been refused, up to the last one.
  double StreakS() const;
  // Seconds since the last refusal; std::nullopt: there was none.
  std::optional<double> QuietS(Time t) const;
  void EndStreak() { streak_since_.reset(); }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.seconds_, self.last_, self.last_refused_, self.streak_since_, self.since_);
  }

 private:
  static constexpr std::int64_t kSeconds = 60;
  struct Second {
    std::int64_t second = -kSeconds;  // since 1970
    int samples = 0;
    int refused = 0;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.second, self.samples, self.refused);
    }
  };
  void Tally(Time t, bool refused);

  std::array<Second, kSeconds> seconds_{};
  std::optional<Time> last_;
  std::optional<Time> last_refused_;
  std::optional<Time> streak_since_;
  std::optional<Time> since_;
};

}  // namespace seastitch
