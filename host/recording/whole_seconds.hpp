// Logs whose clock shows whole seconds, while several rows come in each: 10:00:01, 10:00:01, 10:00:01, 10:00:02 ...
//
// The rows of a second are spread evenly over it, those of the first at its end, since the log began within it; where a second
// has fewer rows than most, they are as far apart as elsewhere. Rows that share any other time are a burst and stay so.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/stream.hpp"

namespace flexor::recording {

class WholeSeconds {
 public:
  using Read = std::function<bool(Row&)>;

  // The next row of `read`, at its place in its second. Reads some seconds ahead once two rows share a whole second, and
  // where rows are spread a second ahead from then on. Throws io::InputError, naming `source`, where the seconds hold so
  // unlike numbers of rows that nobody knows when these were.
  bool next(Row& row, const Read& read, const std::string& source);

  // Rows of a second; 0: nothing is spread.
  std::size_t per_second() const { return per_second_; }

 private:
  using Second = std::vector<Row>;

  bool take(Row& row, const Read& read);
  bool take_second(Second& second, const Read& read);
  void look_ahead(Row row, const Read& read, const std::string& source);
  void give(const Second& second, std::size_t before);

  std::deque<Row> ahead_;  // read, but not yet looked at
  std::deque<Row> ready_;
  bool is_settled_ = false;  // whether anything is spread
  std::optional<double> last_s_;
  std::size_t per_second_ = 0;
};

}  // namespace flexor::recording
