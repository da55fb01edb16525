// A table of angles, row by row, every row of it: cells that are empty or "nan" are missing readings, columns
// of text are nobody's business, and the clock may start again as it does from trial to trial.
//
// recording::CsvReader repairs and leaves out rows; here what comes out has the rows of what came in.
//
// Errors are io::InputError, one line with file, row, column and the mend.
#pragma once

#include <istream>
#include <string>
#include <vector>

#include "host/recording/lines.hpp"

namespace flexor::posture {

struct TableRow {
  std::string time;  // in seconds, as it is written there
  double t_s = 0;
  std::vector<double> value;  // of the columns asked for; NaN: missing
};

class TableReader {
 public:
  // Reads the header. Cells are separated by comma, semicolon or tab; where by no comma, numbers may have decimal commas. The
  // time is t_s, or t or time with another unit: time_ms, t (us). The stream must outlive the reader.
  TableReader(std::istream& stream, std::string source);

  const std::string& source() const { return source_; }
  bool has(const std::string& column) const;
  // Which columns next() gives, in order.
  void choose(const std::vector<std::string>& columns);
  bool next(TableRow& row);
  std::size_t row() const { return lines_.number(); }  // the newest, as an editor counts
  std::string digest() const { return lines_.digest(); }

 private:
  [[noreturn]] void fail(const std::string& what) const;
  std::size_t place_of(const std::string& column) const;
  void find_time();
  void split(const std::string& line);
  double number(std::size_t place) const;

  recording::LineReader lines_;
  std::string source_;
  char delimiter_ = ',';
  std::vector<std::string> header_;
  std::vector<std::string> cells_;
  std::size_t time_place_ = 0;
  double time_unit_s_ = 1;
  std::vector<std::size_t> places_;
};

// Seconds since the row before: a clock that starts again, or a pause, counts as nothing.
double step_s(double before_s, double now_s);

}  // namespace flexor::posture
