#include "host/recording/whole_seconds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::recording {
namespace {

constexpr std::size_t kSeconds = 6;  // that are looked at, the first and the last of them not whole
constexpr std::size_t kMostRowsASecond = 20000;  // of a second
constexpr std::size_t kUnlike = 2;               // times the rows of most seconds, or a part of them

bool is_whole(double t_s) { return t_s == std::floor(t_s); }

}  // namespace

bool WholeSeconds::next(Row& row, const Read& read, const std::string& source) {
  while (ready_.empty()) {
    Second second;
    if (per_second_ > 0) {
      if (!take_second(second, read)) return false;
      give(second, 0);
      continue;
    }
    if (!take(row, read)) return false;
    if (is_settled_) return true;
    const bool again = std::exchange(last_s_, row.t_s) == row.t_s;
    is_settled_ = !is_whole(row.t_s);
    if (is_settled_ || !again) return true;
    look_ahead(std::move(row), read, source);
  }
  row = std::move(ready_.front());
  ready_.pop_front();
  return true;
}

bool WholeSeconds::take(Row& row, const Read& read) {
  if (ahead_.empty()) return read(row);
  row = std::move(ahead_.front());
  ahead_.pop_front();
  return true;
}

bool WholeSeconds::take_second(Second& second, const Read& read) {
  for (Row row; second.size() < kMostRowsASecond && take(row, read);) {
    if (!second.empty() && row.t_s != second.front().t_s) {
      ahead_.push_front(std::move(row));
      break;
    }
    second.push_back(row);
  }
  return !second.empty();
}

// `row` is the second one of its time; the first is given already.
void WholeSeconds::look_ahead(Row row, const Read& read, const std::string& source) {
  is_settled_ = true;
  ahead_.push_front(std::move(row));
  std::vector<Second> seconds;
  bool whole = true;
  for (Second one; whole && seconds.size() < kSeconds && take_second(one, read); one.clear()) {
    whole = is_whole(one.front().t_s) && one.size() < kMostRowsASecond;
    seconds.push_back(one);
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 1; i < seconds.size(); ++i) rows.push_back(seconds[i].size());
  if (rows.size() > 1) rows.pop_back();  // the log may end in it
  std::ranges::sort(rows);
  const std::size_t most = rows.empty() ? 0 : rows[rows.size() / 2];
  if (!whole || most < 2) {
    for (const Second& one : seconds) ready_.insert(ready_.end(), one.begin(), one.end());
    return;
  }
  const auto unlike =
      std::ranges::count_if(rows, [&](std::size_t n) { return n > kUnlike * most || kUnlike * n < most; });
  if (unlike > 1) {
    throw io::InputError(
        "{}: row {}: the times are whole seconds, {} to {} rows in each: nobody knows when these were; log "
        "fractions of a second, or milliseconds (time_ms)",
        source, seconds.front().front().line, rows.front(), rows.back());
  }
  per_second_ = most;
  for (std::size_t i = 0; i < seconds.size(); ++i)
    give(seconds[i], i > 0 ? 0 : std::max(most, seconds[0].size() + 1) - seconds[0].size());
}

// Spread over its second, behind so many places that stay empty.
void WholeSeconds::give(const Second& second, std::size_t before) {
  const auto places = static_cast<double>(std::max(per_second_, second.size() + before));
  for (std::size_t i = 0; i < second.size(); ++i) {
    ready_.push_back(second[i]);
    ready_.back().t_s += static_cast<double>(before + i) / places;
  }
}

}  // namespace flexor::recording
