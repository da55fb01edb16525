#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "apps/cli/commands.hpp"
#include "host/identify/apply.hpp"
#include "host/model/standard_error.hpp"

namespace flexor::cli::apply_command {

struct Options {
  std::string model;
  std::string file;
  std::vector<std::string> inputs;
  std::string arithmetic = "double";
  recording::TimeOptions time;
  bool intervals = false;
  bool track = false;
  bool json = false;
};

identify::ApplyOptions options_of(const Options& o) {
  return {o.model, o.arithmetic, o.intervals, o.track, log_note};
}

void say(const std::vector<model::Followed>& followed) {
  for (const model::Followed& f : followed) {
    if (!f.is_tracked) {
      log(fmt::format("tracked: {} not, the model says nothing of its poses", f.input));
      continue;
    }
    log(fmt::format("tracked: {} shifted by {:+.1f} deg (standard error {:.1f}), stretched by {:+.1f} %{}",
                    f.input, f.shift_deg, f.standard_error_deg, 100 * f.stretch,
                    f.alarmed ? "; ALARM: it drifted more quickly than it is followed" : ""));
  }
}

std::string to_json(const std::vector<model::Followed>& followed) {
  Json out = Json::object();
  for (const model::Followed& f : followed) {
    if (!f.is_tracked) continue;
    out[f.input] = {{"shift_deg", f.shift_deg},
                    {"se_deg", f.standard_error_deg},
                    {"stretch", f.stretch},
                    {"alarm", f.alarmed}};
  }
  return out.dump();
}

// Wide CSV as it comes: each row at once from standard input, in large pieces from a file.
identify::Applied print_csv(const Options& o, const model::Model& model, recording::CsvReader& reader) {
  constexpr std::size_t kPiece = 1 << 16;
  const model::StandardErrors errors(model);
  std::string out = "t_s";
  const auto end = std::back_inserter(out);
  for (const model::Joint& joint : model.joints) {
    fmt::format_to(end, ",{0}_deg,{0}_status", joint.name);
    if (o.intervals) fmt::format_to(end, ",{}_se_deg", joint.name);
  }
  out += '\n';
  auto done = identify::apply(model, reader, options_of(o), [&](const identify::Estimate& row) {
    fmt::format_to(end, "{:.6f}", row.t_s);
    for (std::size_t i = 0; i < row.angle_deg.size(); ++i) {
      fmt::format_to(end, ",{:.4f},{}", row.angle_deg[i], row.status[i]);
      if (o.intervals) fmt::format_to(end, ",{:.4f}", errors.of(i, row.angle_deg[i], row.reading));
    }
    out += '\n';
    if (o.file != "-" && out.size() <= kPiece) return;
    print(out);
    out.clear();
  });
  print(out);
  say(done.followed);
  return done;
}

// A list of numbers that may be long, kept in a file without a name until its turn comes.
class Spool {
 public:
  Spool() : file_(std::tmpfile(), &std::fclose) {
    if (!file_) throw_reason();
  }

  void add(const std::string& number) {
    const std::string text = (empty_ ? "" : ",") + number;
    empty_ = false;
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) throw_reason();
  }

  void print_all() {
    if (std::fflush(file_.get()) != 0) throw_reason();
    std::rewind(file_.get());
    std::string piece(1 << 16, '\0');
    while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), file_.get()))
      print(piece.substr(0, n));
  }

 private:
  [[noreturn]] static void throw_reason() {
    throw io::JobError("a temporary file: cannot be written: {}", std::strerror(errno));
  }

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  bool empty_ = true;
};

// One JSON object. Its lists come one after the other, the estimates all at once.
identify::Applied print_json(const Options& o, const model::Model& model, recording::CsvReader& reader) {
  std::vector<std::string> before = {"{\"t_s\":["};  // each list
  for (const model::Joint& joint : model.joints) {
    const char* const end = before.size() == 1 ? "],\"channels\":{" : "]},";
    before.push_back(fmt::format("{}\"{}\":{{\"angle_deg\":[", end, joint.name));
    before.emplace_back("],\"status\":[");
    if (o.intervals) before.emplace_back("],\"se_deg\":[");
  }
  std::vector<Spool> lists(before.size());
  const model::StandardErrors errors(model);
  auto done = identify::apply(model, reader, options_of(o), [&](const identify::Estimate& e) {
    auto list = lists.begin();
    const auto add = [&](auto number) { (list++)->add(fmt::format("{}", number)); };
    add(e.t_s);
    for (std::size_t i = 0; i < e.angle_deg.size(); ++i) {
      add(e.angle_deg[i]);
      add(e.status[i]);
      if (o.intervals) add(errors.of(i, e.angle_deg[i], e.reading));
    }
  });
  for (std::size_t k = 0; k < lists.size(); ++k) {
    print(before[k]);
    lists[k].print_all();
  }
  print("]}}");
  if (o.track) print(",\"tracking\":" + to_json(done.followed));
  print(fmt::format(",\"version\":\"{}\"}}\n", FLEXOR_VERSION));
  return done;
}

void run(const Options& o) {
  const model::Model model = model::load(o.model);
  recording::CsvReader reader(o.file, {model::columns_of(model, o.inputs), o.time, recording::Holes::some});
  const auto done = o.json ? print_json(o, model, reader) : print_csv(o, model, reader);
  identify::check_ranges(model, reader.name(), reader.columns(), done.ranges, log_warning, done.row_period_s);
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "apply", "Turn sensor readings into angles: wide CSV on standard output", run,
                  "one JSON object instead, when the recording has ended");
  command->footer(
      "For each joint a column <joint>_deg and <joint>_status: 0 ok, 1 below and 2 above the valid range,\n"
      "3 not a number, 4 pause of the log. With anything but 0 the last good reading is held.\n"
      "Exit status 3: all is written, but readings of a column are not what the model knows; the message "
      "says how.");
  command->add_option("model", o->model, "model document")->required();
  command->add_option("file", o->file, "CSV recording; - reads standard input row by row")->required();
  command->add_option("--input", o->inputs,
                      "input columns, one for each of the model's inputs (default: those in the model)");
  add_shown(*command, "--arithmetic", o->arithmetic, "double, float or fixed (as in the glove)")
      ->check(CLI::IsMember({"double", "float", "fixed"}));
  add_time_options(*command, o->time);
  command->add_flag(
      "--intervals", o->intervals,
      "also <joint>_se_deg: the root mean square error of such an angle on data that the fit did not see");
  command->add_flag(
      "--track", o->track,
      "follow each sensor while the glove is worn, from whole bends; corrections are reported at the end");
}

}  // namespace flexor::cli::apply_command
