#include <fmt/format.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <optional>

#include "apps/cli/commands.hpp"
#include "host/io/io.hpp"
#include "host/model/simulation.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace {

struct Options {
  std::string model;
  std::string file;
  std::vector<std::string> inputs;
  std::string arithmetic = "double";
};

const char* status_name(core::Status status) {
  switch (status) {
    case core::Status::ok:
      return "ok";
    case core::Status::below_range:
      return "below_range";
    case core::Status::above_range:
      return "above_range";
    case core::Status::not_a_number:
      return "not_a_number";
  }
  return "";
}

// Feeds uneven rows to the compensator on its own even grid: a grid point between two rows gets the straight
// line between them. In a pause the angle is held and the state left alone; after a long one the grid starts
// anew.
template <class Arithmetic>
class Stream {
 public:
  explicit Stream(const model::Model& model)
      : simulation_(model), period_s_(model.sample_period_s), max_gap_s_(std::max(0.3, 5 * period_s_)) {
    last_deg_.resize(model.channels.size());
    std::string header = "t_s";
    for (const model::Channel& c : model.channels) header += fmt::format(",{0}_deg,{0}_status", c.name);
    print(header + "\n");
    for (std::size_t i = 0; i < last_deg_.size(); ++i) last_deg_[i] = model.channels[i].rest_deg;
  }

  void row(const recording::CsvReader::Row& now) {
    if (!before_ || now.t_s - before_->t_s > kRestart_s) {
      start_s_ = now.t_s;
      next_ = 0;
    } else if (now.t_s <= before_->t_s) {
      ++skipped_;
      return;
    }
    while (grid_time() <= now.t_s) emit(now);
    before_ = now;
    if (out_.size() > kFlush || &std::cin == stream_) flush();
  }

  void finish() {
    flush();
    if (skipped_ > 0)
      log(fmt::format("warning: {} row(s) whose time does not increase were left out", skipped_));
  }

  void follow(const std::istream* stream) { stream_ = stream; }

 private:
  static constexpr double kRestart_s = 10;
  static constexpr std::size_t kFlush = 1 << 16;

  double grid_time() const { return start_s_ + static_cast<double>(next_) * period_s_; }

  void emit(const recording::CsvReader::Row& now) {
    const double t = grid_time();
    ++next_;
    const bool first = !before_ || t >= now.t_s;
    const bool pause = before_ && now.t_s - before_->t_s > max_gap_s_ && !first;
    fmt::format_to(std::back_inserter(out_), "{}", t);
    for (std::size_t i = 0; i < last_deg_.size(); ++i) {
      const char* status = "pause";
      if (!pause) {
        double u = now.value[i];
        if (!first) {
          const double share = (t - before_->t_s) / (now.t_s - before_->t_s);
          u = before_->value[i] + share * (u - before_->value[i]);
        }
        const auto sample = simulation_.step(i, u);
        last_deg_[i] = sample.angle_deg;
        status = status_name(sample.status);
      }
      fmt::format_to(std::back_inserter(out_), ",{:.4f},{}", last_deg_[i], status);
    }
    out_.push_back('\n');
  }

  void flush() {
    print(fmt::to_string(out_));
    out_.clear();
  }

  model::Simulation<Arithmetic> simulation_;
  double period_s_;
  double max_gap_s_;
  std::optional<recording::CsvReader::Row> before_;
  double start_s_ = 0;
  std::size_t next_ = 0;
  std::size_t skipped_ = 0;
  std::vector<double> last_deg_;
  fmt::memory_buffer out_;
  const std::istream* stream_ = nullptr;
};

std::vector<std::string> input_columns(const Options& o, const model::Model& model) {
  if (!o.inputs.empty() && o.inputs.size() != model.channels.size()) {
    throw io::InputError(
        fmt::format("the model has {} channel(s), {} --input given; name one for each, in order",
                    model.channels.size(), o.inputs.size()));
  }
  if (!o.inputs.empty()) return o.inputs;
  std::vector<std::string> columns;
  for (const model::Channel& c : model.channels)
    columns.push_back(c.input_column.empty() ? c.name : c.input_column);
  return columns;
}

template <class Arithmetic>
void stream(const model::Model& model, std::istream& in, const std::string& source,
            const std::vector<std::string>& columns) {
  recording::CsvReader reader(in, source, {columns, {}, {}});
  Stream<Arithmetic> out(model);
  out.follow(&in);
  recording::CsvReader::Row row;
  while (reader.next(row)) out.row(row);
  out.finish();
}

void run(const Options& o) {
  const model::Model model = model::load(o.model);
  const std::vector<std::string> columns = input_columns(o, model);
  std::ifstream file;
  if (o.file != "-") {
    io::require_readable(o.file);
    file.open(o.file, std::ios::binary);
  }
  std::istream& in = o.file == "-" ? std::cin : file;
  const std::string source = o.file == "-" ? "standard input" : o.file;
  if (o.arithmetic == "fixed") {
    stream<model::FixedArithmetic>(model, in, source, columns);
  } else if (o.arithmetic == "float") {
    stream<model::FloatArithmetic>(model, in, source, columns);
  } else {
    stream<model::DoubleArithmetic>(model, in, source, columns);
  }
}

}  // namespace

void add_apply(CLI::App& app) {
  auto o = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("apply", "Turn sensor readings into angles: wide CSV on standard output");
  command->add_option("model", o->model, "model document")->required();
  command->add_option("file", o->file, "CSV recording; - reads standard input row by row")->required();
  command->add_option("--input", o->inputs,
                      "input columns, one for each channel (default: those in the model)");
  command->add_option("--arithmetic", o->arithmetic, "double, float or fixed (as in the glove)")
      ->check(CLI::IsMember({"double", "float", "fixed"}))
      ->capture_default_str();
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
