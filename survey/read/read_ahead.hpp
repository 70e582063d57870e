#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "survey/read/sample_source.hpp"

namespace seastitch {

// Reads a source on a thread of its own, some hundred samples ahead. The samples are the same, in
// the same order.
class ReadAhead {
 public:
  // source: must outlive this object, and is not to be used meanwhile.
  explicit ReadAhead(SampleSource* source);
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  struct Item {
    Received sample;
    std::size_t input;
  };
  // As SampleSource::Next().
  std::optional<Item> Next();
  int percent_read() const { return batch_.percent_read; }

 private:
  // Samples pass in batches: a lock for each would cost more than a sample.
  struct Batch {
    std::vector<Item> items;
    int percent_read = 0;
  };
  void Run();

  SampleSource* const source_;
  Batch batch_;  // of which the first next_ were given
  std::size_t next_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Batch> ready_;
  bool is_read_ = false;     // to its end
  bool is_stopped_ = false;  // by the destructor
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace seastitch
