// Any bytes as a log: rows that hold what Stream and Resampler promise, or an InputError of one line of
// UTF-8.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/resample.hpp"

namespace {

using namespace flexor;

void require(bool good) {
  if (!good) std::abort();
}

void require_line(const std::string& text) {
  require(text.find('\n') == std::string::npos && recording::is_utf8(text));
}

// As apply reads it: resets followed, one row at a time, onto a grid.
void follow(const std::string& text) {
  std::istringstream bytes(text);
  recording::CsvReader reader(bytes, "fuzz", {});
  recording::Stream stream(reader, recording::Resets::follow);
  recording::Resampler resampler(std::vector(reader.columns().size(), recording::Range{}), 0.05, 0.3);
  recording::Row row;
  double last_s = -HUGE_VAL;
  std::size_t rows = 0;
  std::size_t samples = 0;
  while (stream.next(row)) {
    require(std::isfinite(row.t_s) && row.t_s >= last_s && row.value.size() == reader.columns().size());
    last_s = row.t_s;
    ++rows;
    resampler.push(row.t_s, row.value, [&](const recording::Sample& s) {
      ++samples;
      for (const double v : s.value) require(std::isfinite(v));
    });
    require(samples <=
            202 * rows);  // ten seconds' worth for each row: memory follows the rows, not the times
  }
  for (const std::string& note : stream.notes()) require_line(note);
}

void read_whole(const std::string& text) {
  const auto r = recording::parse_csv(text, "fuzz", {});
  for (const auto& column : r.columns) {
    require(column.value.size() == r.t_s.size());
    for (const double v : column.value) require(std::isfinite(v));
  }
  const bool whole = std::ranges::all_of(r.t_s, [](double t_s) { return t_s == std::floor(t_s); });
  if (r.columns.empty() || whole) return;  // rows that share whole seconds would be spread over them
  // What was written reads back the same.
  recording::Recording named = r;
  for (std::size_t i = 0; i < named.columns.size(); ++i) named.columns[i].name = "c" + std::to_string(i);
  const auto back = recording::parse_csv(recording::to_csv(named), "fuzz", {});
  require(back.t_s == r.t_s && back.columns.size() == r.columns.size());
  for (std::size_t i = 0; i < r.columns.size(); ++i) require(back.columns[i].value == r.columns[i].value);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const auto read : {follow, read_whole}) {
    try {
      read(text);
    } catch (const io::InputError& error) {
      require_line(error.what());
    }
  }
  return 0;
}
