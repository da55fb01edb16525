#include <algorithm>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/arduino_library.hpp"
#include "host/deploy/calibration.hpp"
#include "host/deploy/deployment.hpp"
#include "host/deploy/hardware.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/out_folder.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/identify/apply.hpp"
#include "host/identify/map_check.hpp"
#include "host/recording/csv.hpp"
#include "host/report/render.hpp"

namespace flexor::cli::deploy_command {

struct Options {
  std::string model;
  std::optional<double> rate_hz;
  std::string out;
  deploy::Output output = deploy::Output::radio;
  std::string hardware = "flexor";
  double baud = 0;  // 0: the hardware's
  std::string key;
  bool new_key = false;
  bool plain = false;
  std::string calibration;
  std::string recording;
  bool allow_missing = false;
  deploy::Encoding encoding = deploy::Encoding::alpha;
  bool right_hand = true;
  bool track = false;
};

// Readings of the model's inputs, row by row, from a recording's columns.
std::vector<std::vector<double>> readings_of(const model::Model& model, const std::string& path) {
  const std::vector<std::string> columns = model::columns_of(model, {});
  const recording::Recording r = recording::read_csv(path, columns);
  std::vector<std::vector<double>> out(r.t_s.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const recording::Column& c = r.column(columns[i]);
    if (const auto note = identify::unit_note(model.inputs[i], path, c.name, c.unit)) log_note(*note);
    for (std::size_t k = 0; k < out.size(); ++k) out[k].push_back(c.value[k]);
  }
  model::RangeCount ranges(model);
  for (const std::vector<double>& row : out) ranges.add(row);
  try {
    identify::check_ranges(model, path, columns, ranges, log_warning);
  } catch (const io::Doubt& doubt) {  // nothing is written yet
    throw io::InputError(doubt.what());
  }
  return out;
}

struct PairKey {
  deploy::Key key;     // none: plain frames, or no radio
  const char* origin;  // "new", "reused" or "given"; null: no key
  bool is_stored;      // in OUT already
};

link::Key given_key(const std::string& text) {
  std::error_code error;
  const bool hex = deploy::is_key(text) && !std::filesystem::exists(text, error);
  if (!hex && text != "-" && !std::filesystem::exists(text, error))
    throw io::InputError("--key: no file of this name, and not 32 hexadecimal digits either");
  if (!hex) return deploy::load_key(text);
  log_warning(
      "a key on the command line shows in the process list and the shell's history: --key takes a file");
  return deploy::key_from_hex(text);
}

// A glove and a hand keep their key from one deployment to the next, unless another is given. A file that is
// not a key might have been one: it is refused, never replaced.
PairKey choose_key(const Options& o) {
  if (o.plain || o.output != deploy::Output::radio) return {{}, nullptr, false};
  const std::filesystem::path path = std::filesystem::path(o.out) / deploy::kKeyFile;
  std::error_code error;
  const auto type = std::filesystem::symlink_status(path, error).type();
  const bool is_there = type != std::filesystem::file_type::not_found;
  if (is_there && type != std::filesystem::file_type::regular)
    throw io::InputError("{}: is not a plain file: move it away", path.string());
  const deploy::Key stored = is_there ? deploy::load_key(path) : deploy::Key();
  if (!o.key.empty()) {
    const link::Key key = given_key(o.key);
    return {key, "given", stored && deploy::to_hex(*stored) == deploy::to_hex(key)};
  }
  if (stored && !o.new_key) return {stored, "reused", true};
  return {deploy::new_key(), "new", false};
}

// How counts become what the model reads, for the report.
std::string calibration_words(const Options& o, const model::Model& model,
                              const deploy::CalibrationDocument& own, double divider_kohm) {
  const bool alpha = std::ranges::any_of(model.inputs, deploy::reads_alpha);
  const std::string otherwise =
      alpha ? fmt::format("the divider of {:g} kOhm and flex sensors", divider_kohm) : "counts as they are";
  if (o.calibration.empty()) return fmt::format("{}; --calibration FILE takes this glove's own", otherwise);
  std::vector<std::string> fingers;
  for (std::size_t f = 0; f < model::kFingers; ++f)
    if (own.sensor[f]) fingers.push_back(model::finger_names()[f]);
  const std::string file = std::filesystem::path(o.calibration).filename().string();
  if (fingers.size() == model::kFingers) return fmt::format("{}, of every finger", file);
  return fmt::format("{} of {}; the others: {}", file, fmt::join(fingers, ", "), otherwise);
}

void warn_of_guesses(const Options& o, const deploy::Glove& glove) {
  const model::Wiring wiring = model::wiring_of(glove.model);
  for (const std::size_t input : wiring.guessed) {
    const std::size_t finger = wiring.sensor[input];
    log_warning(
        fmt::format("{}: nothing says where {} is: it is read at A{}, the pin of the {}'s sensor, which is "
                    "free; name its column after its "
                    "finger, or add \"strip\": \"{}\", or another finger, to this input of the model",
                    o.model, glove.model.inputs[input].name, glove.pins.strip[finger],
                    model::finger_names()[finger], model::finger_names()[finger]));
  }
}

void require_fingers(const Options& o, const deploy::Glove& glove) {
  const std::vector<std::string> missing = model::missing_fingers(glove.model);
  if (glove.output != deploy::Output::opengloves || o.allow_missing || missing.empty()) return;
  throw io::InputError(
      "{}: has no joint for {}, which VR would show straight: identify all five fingers, or add "
      "--allow-missing",
      o.model, fmt::join(missing, ", "));
}

// A radio's glove has one button at most, which zeroes it.
void require_of_vr(const Options& o, const deploy::Glove& glove) {
  if (o.output == deploy::Output::opengloves) return;
  const model::Pins& pins = glove.pins;
  const auto buttons = std::ranges::count_if(pins.button, [](const auto& pin) { return pin.has_value(); });
  const bool zeroes = pins.button.back().has_value();
  if (pins.joystick || buttons > (zeroes ? 1 : 0))
    throw io::InputError(
        "--hardware: joystick and buttons but calibrate go to VR drivers: add --output opengloves, or leave "
        "them out");
  if (zeroes && !deploy::can_zero(glove))
    throw io::InputError(
        "--hardware: calibrate: {} does not know what its sensors read at the open hand and at "
        "the fist: identify it from a recording that has both, or leave the button out",
        o.model);
  if (o.encoding != deploy::Encoding::alpha)
    throw io::InputError("--encoding: is of text for VR drivers: add --output opengloves");
}

// For a glove that logs: nothing of it leaves the board but counts.
model::Model logging_model() {
  model::Model out;
  out.name = "log";
  out.sample_period_s = 0.01;
  for (const std::string& finger : model::finger_names()) {
    out.inputs.push_back({finger, finger + "_count", "count", finger, 1, 1022});
    out.blocks.push_back({{finger}, finger + " line", model::Curve{{0, 1023}, {0, 90}}});
    out.blocks.push_back({{finger + " line"}, finger + " angle", model::Saturation{0, 90}});
    out.joints.push_back({finger, finger + " angle", 0, {}});
  }
  return out;
}

// What the options ask for. Refuses, before anything is written, what the boards or the radio cannot do.
deploy::Deployment plan(const Options& o, const model::Hardware& hardware, const deploy::Key& key) {
  if (o.model.empty() && o.output != deploy::Output::log)
    throw io::InputError("MODEL is required, but with --output log");
  model::Model model = o.model.empty() ? logging_model() : model::load(o.model);
  set_rate(model, o.rate_hz);
  deploy::Deployment d;
  std::vector<std::string> notes;
  if (o.output == deploy::Output::radio) model = deploy::on_hand(std::move(model), hardware, notes);
  for (const std::string& note : notes) log(note);
  const deploy::CalibrationDocument own =
      o.calibration.empty() ? deploy::CalibrationDocument() : deploy::load_calibration(o.calibration);
  d.hardware = hardware;
  d.glove = deploy::glove_for(hardware, model, key, own);
  d.calibration = calibration_words(o, model, own, hardware.divider_kohm);
  const auto of_sensor = [](const model::Input& input) {
    return input.unit != "count" && !input.unit.ends_with('V');
  };
  if (hardware.sensor == model::SensorKind::potentiometer && own.unit.empty() &&
      std::ranges::any_of(model.inputs, of_sensor))
    throw io::InputError(
        "{}: reads a flex sensor's unit, which potentiometers have not: identify it from counts or V, "
        "or make \"sensor\" of {} \"flex\"",
        o.model, hardware.source);
  d.folder = o.out;
  d.glove.encoding = o.encoding;
  d.glove.right_hand = o.right_hand;
  d.glove.output = o.output;
  require_of_vr(o, d.glove);
  require_fingers(o, d.glove);
  warn_of_guesses(o, d.glove);
  d.glove.track = o.track;
  deploy::check_tracking(d.glove);
  (void)deploy::samples_per_frame(d.glove);
  (void)deploy::uart_divisor(d.glove.output == deploy::Output::radio ? d.glove.baud : deploy::kUsbBaud);
  return d;
}

// What the model reads on the board for these counts.
std::vector<std::vector<double>> readings_of(const deploy::Glove& glove, const study::Counts& counts) {
  const deploy::GloveTables tables = deploy::glove_tables(glove);
  const model::Wiring wiring = model::wiring_of(glove.model);
  std::vector<std::vector<double>> out;
  for (const auto& sample : counts) {
    std::vector<double>& row = out.emplace_back();
    for (const std::size_t finger : wiring.sensor) {
      row.push_back(tables.calibration[finger](static_cast<std::uint16_t>(sample[finger])) / 32.0);
    }
  }
  return out;
}

void measure(deploy::Deployment& d, const study::Boards& boards, const study::Counts& counts) {
  ProgressLine line;
  line.show("running the glove's image ...");
  d.glove_figures = boards.run_glove(d.glove, counts);
  if (d.glove_figures.mismatches > 0)
    throw io::JobError(
        "the glove's image differs from the host in {} of {} messages: this is a defect of "
        "Flexor, please report it",
        d.glove_figures.mismatches, d.glove_figures.frames);
  if (d.glove.output != deploy::Output::radio) return;
  line.show("running the hand's image ...");
  constexpr double kHandSeconds = 5;
  d.hand_figures = boards.run_hand(d.hardware, d.glove, kHandSeconds);
}

// What is flashed, folders, what was measured of them, and the report, all in `folder`.
Json build(const Options& o, const study::Boards* boards, const study::Counts& counts, deploy::Deployment& d,
           const std::filesystem::path& folder) {
  const auto write = [&](const char* name, const deploy::FlashContent& flash) {
    io::write_file(folder / name, deploy::to_intel_hex(flash), io::Access::owner);
  };
  write("glove.hex", deploy::glove_flash(d.glove));
  if (d.glove.output == deploy::Output::radio)
    write("hand.hex", deploy::hand_flash(deploy::safe_hand(d.hardware, d.glove.model, d.glove.key)));
  io::write_file(folder / deploy::kHardwareFile, io::dump(model::to_json(d.hardware)));
  deploy::write_arduino_library(d.glove, folder / deploy::kArduinoFolder);
  if (boards != nullptr) measure(d, *boards, counts);
  save_results(d, folder);
  Json json = io::parse_json(io::read_file(folder / "results.json"), "results.json");
  report::render(folder);
  json["folder"] = o.out;
  json["model"] = o.model;
  return json;
}

std::string in_words(const deploy::Deployment& d, const PairKey& pair, const Json& json) {
  const std::string folder = io::one_line(d.folder);
  const bool radio = d.glove.output == deploy::Output::radio;
  std::string text = report::summary("deployment", json);
  text += fmt::format(
      "\nimages    {0}/glove.hex{1}\nwiring    {0}/wiring.md, {0}/wiring_glove.svg{2}\nArduino   "
      "{0}/arduino\n"
      "report    {0}/report.html\n",
      folder, radio ? fmt::format(", {}/hand.hex", folder) : "",
      radio ? fmt::format(", {}/wiring_hand.svg", folder) : "");
  if (pair.origin == nullptr) return text;
  const std::string is = pair.origin == std::string("reused")
                             ? "the one that was there, used again; --new-key makes another"
                             : "keep it, --key takes it for one board alone";
  return text + fmt::format("key       {}/{}: {}\n", folder, deploy::kKeyFile, is);
}

Output run(const Options& o) {
  std::optional<study::Boards> boards;
  if (const auto worker = io::program_beside(kBoardsWorker); std::filesystem::exists(worker))
    boards.emplace(worker);
  io::require_folder(o.out, "deployment");
  twin::Parameters p;
  static_cast<model::Hardware&>(p) = model::hardware(o.hardware);
  if (o.baud != 0) p.baud = o.baud;
  const PairKey pair = choose_key(o);
  deploy::Deployment d = plan(o, p, pair.key);
  const study::Counts counts = study::gesture_counts(p, d.glove.model);
  d.recording =
      o.recording.empty() ? "the six gestures" : std::filesystem::path(o.recording).filename().string();
  d.error =
      deploy::fixed_point_error(d.glove.model, o.recording.empty() ? readings_of(d.glove, counts)
                                                                   : readings_of(d.glove.model, o.recording));
  deploy::OutFolder out(o.out);
  Json json = build(o, boards ? &*boards : nullptr, counts, d, out.staging());
  json["key"] = pair.origin != nullptr ? Json(pair.origin) : nullptr;
  io::write_file(out.staging() / "report.json", io::dump(json));
  if (pair.key && !pair.is_stored) {
    deploy::write_key(out.staging() / deploy::kKeyFile, *pair.key);
    const auto kept = deploy::keep_old_key(std::filesystem::path(o.out) / deploy::kKeyFile, *pair.key);
    if (!kept.empty()) log(kept);
  }
  out.publish();
  return {json, in_words(d, pair, json)};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(app, "deploy",
                                        "Flash content for glove and hand from a model file: image, "
                                        "settings, model; with what it costs measured",
                                        run);
  command->add_option("MODEL", o->model, "model file; --output log needs none");
  command->add_option("--rate", o->rate_hz, "sample rate: 10, 20, 50 or 100 Hz (default: the model's)");
  add_folder(*command, "--out", o->out,
             "write what is flashed, wiring, an Arduino library and the report into this folder")
      ->required();
  add_choice(*command, "--output", o->output, deploy::kOutputs,
             "of the glove: radio; over USB opengloves, lines for VR drivers, text, lines of angles, or log, "
             "lines of counts");
  add_hardware(*command, o->hardware);
  command->add_flag("--allow-missing", o->allow_missing,
                    "text for VR drivers although the model lacks fingers: they are sent as straight");
  using deploy::Encoding;
  add_choice(
      *command, "--encoding", o->encoding, {{"alpha", Encoding::alpha}, {"beta", Encoding::beta}},
      "of text for VR drivers: alpha, a number for each finger, or beta, the model's other joints as well");
  add_choice(*command, "--hand", o->right_hand, {{"left", false}, {"right", true}},
             "which hand the glove tells a VR driver that asks: left or right");
  command->add_option("--baud", o->baud, "of the radio (default: radio.baud of the hardware)");
  auto* key = command->add_option("--key", o->key,
                                  "file with the pair's key, 32 hexadecimal digits; - is standard input "
                                  "(default: OUT/pair.key, where there is none a new one)");
  auto* new_key = command->add_flag("--new-key", o->new_key, "a new key, also where OUT/pair.key is there")
                      ->excludes(key);
  command->add_flag("--plain", o->plain, "frames without authentication: anybody in range can move the hand")
      ->excludes(key)
      ->excludes(new_key);
  command->add_option(
      "--calibration", o->calibration,
      "JSON (docs/calibration.md): for each finger \"counts\" and \"value\", two or more points, and their "
      "\"unit\" (default: the article's divider for a model of its alpha, counts for one of counts)");
  command->add_option("--recording", o->recording,
                      "CSV with the model's input columns: also measure the error over it");
  command->add_flag(
      "--track", o->track,
      "the glove follows its sensors while it is worn, from whole bends (not in the Arduino library)");
}

}  // namespace flexor::cli::deploy_command
