#include <fmt/format.h>

#include <fstream>
#include <functional>
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
  bool json = false;
};

// The runtime's status, and 4 for a pause of the log.
constexpr int kPause = 4;

struct Row {
  double t_s;
  std::vector<double> angle_deg;
  std::vector<int> status;
};

// Feeds uneven rows to the compensator on its own even grid: a grid point between two rows gets the straight
// line between them. In a pause the angle is held and the state left alone; after a long one the grid starts
// anew.
template <class Arithmetic>
class Stream {
 public:
  Stream(const model::Model& model, std::function<void(const Row&)> sink)
      : simulation_(model),
        sink_(std::move(sink)),
        period_s_(model.sample_period_s),
        max_gap_s_(std::max(0.3, 5 * period_s_)) {
    for (const model::Channel& c : model.channels) row_.angle_deg.push_back(c.rest_deg);
    row_.status.resize(model.channels.size());
  }

  void push(const recording::CsvReader::Row& now) {
    if (!before_ || now.t_s - before_->t_s > kRestart_s) {
      start_s_ = now.t_s;
      next_ = 0;
    } else if (now.t_s <= before_->t_s) {
      ++skipped_;
      return;
    }
    while (grid_time() <= now.t_s) emit(now);
    before_ = now;
  }

  std::size_t skipped() const { return skipped_; }

 private:
  static constexpr double kRestart_s = 10;

  double grid_time() const { return start_s_ + static_cast<double>(next_) * period_s_; }

  void emit(const recording::CsvReader::Row& now) {
    row_.t_s = grid_time();
    ++next_;
    const bool on_row = !before_ || row_.t_s >= now.t_s;
    const bool pause = !on_row && now.t_s - before_->t_s > max_gap_s_;
    for (std::size_t i = 0; i < row_.angle_deg.size(); ++i) {
      if (pause) {
        row_.status[i] = kPause;
        continue;
      }
      double u = now.value[i];
      if (!on_row) {
        const double share = (row_.t_s - before_->t_s) / (now.t_s - before_->t_s);
        u = before_->value[i] + share * (u - before_->value[i]);
      }
      const auto sample = simulation_.step(i, u);
      row_.angle_deg[i] = sample.angle_deg;
      row_.status[i] = static_cast<int>(sample.status);
    }
    sink_(row_);
  }

  model::Simulation<Arithmetic> simulation_;
  std::function<void(const Row&)> sink_;
  double period_s_;
  double max_gap_s_;
  std::optional<recording::CsvReader::Row> before_;
  double start_s_ = 0;
  std::size_t next_ = 0;
  std::size_t skipped_ = 0;
  Row row_;
};

// Wide CSV as it comes: each row at once from standard input, in large pieces from a file.
class CsvSink {
 public:
  CsvSink(const model::Model& model, bool live) : live_(live) {
    fmt::format_to(std::back_inserter(out_), "t_s");
    for (const model::Channel& c : model.channels) {
      fmt::format_to(std::back_inserter(out_), ",{0}_deg,{0}_status", c.name);
    }
    out_.push_back('\n');
  }

  void operator()(const Row& row) {
    fmt::format_to(std::back_inserter(out_), "{:.6f}", row.t_s);
    for (std::size_t i = 0; i < row.angle_deg.size(); ++i) {
      fmt::format_to(std::back_inserter(out_), ",{:.4f},{}", row.angle_deg[i], row.status[i]);
    }
    out_.push_back('\n');
    if (live_ || out_.size() > kPiece) flush();
  }

  void flush() {
    print(fmt::to_string(out_));
    out_.clear();
  }

 private:
  static constexpr std::size_t kPiece = 1 << 16;
  bool live_;
  fmt::memory_buffer out_;
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

// Returns how many rows were left out because their time does not increase.
std::size_t follow(const Options& o, const model::Model& model, recording::CsvReader& reader,
                   const std::function<void(const Row&)>& sink) {
  const auto with = [&]<class Arithmetic>(Stream<Arithmetic> stream) {
    recording::CsvReader::Row row;
    while (reader.next(row)) stream.push(row);
    return stream.skipped();
  };
  if (o.arithmetic == "fixed") return with(Stream<model::FixedArithmetic>(model, sink));
  if (o.arithmetic == "float") return with(Stream<model::FloatArithmetic>(model, sink));
  return with(Stream<model::DoubleArithmetic>(model, sink));
}

std::size_t print_json(const Options& o, const model::Model& model, recording::CsvReader& reader) {
  std::vector<double> t_s;
  std::vector<std::vector<double>> angle_deg(model.channels.size());
  std::vector<std::vector<int>> status(model.channels.size());
  const std::size_t skipped = follow(o, model, reader, [&](const Row& row) {
    t_s.push_back(row.t_s);
    for (std::size_t i = 0; i < angle_deg.size(); ++i) {
      angle_deg[i].push_back(row.angle_deg[i]);
      status[i].push_back(row.status[i]);
    }
  });
  nlohmann::ordered_json json = {{"t_s", t_s}};
  for (std::size_t i = 0; i < angle_deg.size(); ++i) {
    json["channels"][model.channels[i].name] = {{"angle_deg", angle_deg[i]}, {"status", status[i]}};
  }
  json["version"] = FLEXOR_VERSION;
  print(json.dump() + "\n");
  return skipped;
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
  recording::CsvReader reader(in, o.file == "-" ? "standard input" : o.file, columns);
  std::size_t skipped = 0;
  if (o.json) {
    skipped = print_json(o, model, reader);
  } else {
    CsvSink sink(model, o.file == "-");
    skipped = follow(o, model, reader, std::ref(sink));
    sink.flush();
  }
  if (skipped > 0) log(fmt::format("warning: {} row(s) whose time does not increase were left out", skipped));
}

}  // namespace

void add_apply(CLI::App& app) {
  auto o = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("apply", "Turn sensor readings into angles: wide CSV on standard output");
  command->footer(
      "For each channel a column <finger>_deg and <finger>_status: 0 ok, 1 below and 2 above the valid "
      "range,\n"
      "3 not a number, 4 pause of the log. With anything but 0 the last good angle is held.");
  command->add_option("model", o->model, "model document")->required();
  command->add_option("file", o->file, "CSV recording; - reads standard input row by row")->required();
  command->add_option("--input", o->inputs,
                      "input columns, one for each channel (default: those in the model)");
  command->add_option("--arithmetic", o->arithmetic, "double, float or fixed (as in the glove)")
      ->check(CLI::IsMember({"double", "float", "fixed"}))
      ->capture_default_str();
  command->add_flag("--json", o->json, "one JSON object instead, when the recording has ended");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
