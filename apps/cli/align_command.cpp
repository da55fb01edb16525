#include "apps/cli/commands.hpp"
#include "host/identify/joint_map.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli::align_command {

struct Options {
  identify::SourceFiles files;
  double rate_hz = 20;
  std::optional<double> clock_offset_s;
  std::string out;
};

std::string in_words(const Options& o, const recording::Aligned& aligned) {
  const recording::Alignment a = aligned.alignment.value_or(recording::Alignment());
  const std::string error = a.clock_offset_se_s ? fmt::format(" +- {:.3f}", *a.clock_offset_se_s) : "";
  std::string text = fmt::format("clock offset   {:+.3f} s{} (reference time minus sensor time)\n",
                                 aligned.clock_offset_s, o.clock_offset_s ? ", as given" : error);
  if (o.clock_offset_s && aligned.alignment)
    text +=
        fmt::format("by the signals {:+.3f} s{}; what follows is of this offset\n", a.clock_offset_s, error);
  if (a.sensor_lag_s)
    text += fmt::format("sensor lag     {:+.3f} s, of the readings behind the angle\n", *a.sensor_lag_s);
  text += aligned.alignment
              ? fmt::format(
                    "confidence     {:.2f} (the probability that the offset is right to 0.15 s)\n"
                    "explained      {:.0f} % of the angle by the sensor at this offset\n",
                    a.confidence, 100 * a.eta_squared)
              : "confidence     none: the offset is as given, the signals alone do not tell\n";
  if (a.tapped) text += "tapped         three quick bends in both logs agree\n";
  text += fmt::format("overlap        {:.1f} s\n", aligned.t_s.back() - aligned.t_s[aligned.overlap_begin]);
  if (a.drift_se_ppm)
    text +=
        fmt::format("drift          {:+.0f} ppm +- {:.0f}, by which the reference's clock runs fast{}\n",
                    *a.drift_ppm, *a.drift_se_ppm, o.clock_offset_s ? "" : "; taken out where it is clear");
  return text + (o.out.empty() ? "" : fmt::format("written        {}\n", o.out));
}

Output run(const Options& o) {
  std::error_code error;
  const bool device =
      std::filesystem::exists(o.out, error) && !std::filesystem::is_regular_file(o.out, error);
  if (!o.out.empty() && std::filesystem::path(o.out).extension() != ".csv" && !device)
    throw io::InputError("{}: aligned recordings are written as .csv", o.out);
  if (!o.out.empty()) io::require_writable(o.out);
  const recording::Pair pair = identify::load_pair(o.files, o.clock_offset_s.has_value());
  const recording::Aligned aligned = recording::align_pair(pair, o.rate_hz, o.clock_offset_s);
  if (!o.out.empty() && !o.clock_offset_s && aligned.alignment)
    identify::refuse_unsure(pair.sensor.source, aligned.clock_offset_s, aligned.alignment->confidence,
                            aligned.alignment->jump.value_or(""));
  if (!o.out.empty()) io::write_file(o.out, recording::to_csv(recording::to_recording(aligned, pair)));
  return {to_json(aligned), in_words(o, aligned), aligned.warnings};
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "align", "Find the clock offset of two logs of one motion from their signals", run);
  command->add_option("--sensor", o->files.sensor, "CSV log of the glove")->required();
  command->add_option("--reference", o->files.reference, "CSV of the measured angle (camera)")->required();
  command->add_option("--input", o->files.input, "column of the sensor log (default: its only one)");
  command->add_option("--output", o->files.output,
                      "column of the reference, degrees (default: its only one)");
  add_shown(*command, "--rate", o->rate_hz, "sample rate of the aligned recording, Hz");
  command->add_option("--clock-offset", o->clock_offset_s,
                      "use this offset in seconds (reference minus sensor) and check it against the signals");
  command->add_option("--output-unit", o->files.output_unit,
                      "deg or rad: of the angle, where its column's name states none (default: deg)");
  add_time_options(*command, o->files.time);
  command->add_option("--out", o->out, "write the aligned recording: .csv");
}

}  // namespace flexor::cli::align_command
