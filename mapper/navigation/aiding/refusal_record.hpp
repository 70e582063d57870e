#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/core/time.hpp"

namespace seastitch {

// Record of a sensor's refused samples.
class RefusalRecord {
 public:
  void Add(Time t, bool refused) { Add(t, refused, 0); }
  // Adds a sample that disagreed and was taken, because another sensor is in doubt. For the filter
  // it counts as refused, for Share() and Since() as used.
  void AddTaken(Time t) { Add(t, true, 1); }
  // Adds a sample that was refused before the filter. It counts in Share() and Since(), which are
  // for people, and nowhere else: bad input must not change the state. Up to some seconds out of
  // order.
  void AddUnusable(Time t);
  // Fraction refused in the minute before `now`, 0 to 1; 0 without a sample.
  double Share(Time now) const;
  // Since when the share has been above a tenth, if it is at `now`.
  std::optional<Time> Since(Time now) const;
  // Whether more than a tenth of the samples that reached the filter disagreed in that minute.
  bool AreOften(Time now) const;
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
    int taken = 0;     // also in refused
    int unusable = 0;  // not in samples

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.second, self.samples, self.refused, self.taken, self.unusable);
    }
  };
  void Add(Time t, bool refused, int taken);
  Second& At(Time t);
  Second Minute(Time now) const;  // sums of the minute before now
  void NoteShare(Time t);

  std::array<Second, kSeconds> seconds_{};
  std::optional<Time> last_;
  std::optional<Time> last_refused_;
  std::optional<Time> streak_since_;
  std::optional<Time> since_;
};

}  // namespace seastitch
