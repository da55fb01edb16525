#include "host/deploy/calibration.hpp"

#include <algorithm>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/correction.hpp"

namespace flexor::deploy {
namespace {

constexpr int kSchemaVersion = 1;

constexpr double kLeastStep = 0.001;  // counts: closer points do not determine the curve between others

bool increasing(const std::vector<double>& x, double least_step = 0) {
  return std::ranges::adjacent_find(x, [&](double a, double b) { return !(b > a && b - a >= least_step); }) ==
         x.end();
}

Sensor read_sensor(io::JsonReader& reader) {
  const std::vector<double> counts = reader.numbers("counts");
  const std::vector<double> value = reader.numbers_within("value", -model::kMaxSignal, model::kMaxSignal);
  reader.done();
  if (counts.size() < 2 || counts.size() != value.size())
    reader.fail("needs at least two points, as many \"counts\" as \"value\"");
  if (!increasing(counts, kLeastStep) || counts.front() < 0 || counts.back() > sensor::kAdcTop) {
    reader.fail(fmt::format("\"counts\" must increase by at least {}, from 0 to at most {}", kLeastStep,
                            sensor::kAdcTop));
  }
  const std::vector<double> falling(value.rbegin(), value.rend());
  if (!increasing(value) && !increasing(falling)) reader.fail("\"value\" must rise or fall throughout");
  return {counts, value};
}

Sensor sensor_of(const model::Input& input, std::size_t finger, const Sensor& alpha,
                 const CalibrationDocument& calibration) {
  const std::optional<Sensor>& own = calibration.sensor[finger];
  const std::string& unit = input.unit;
  const bool counts = unit == "count";
  const bool known = counts || reads_alpha(input);
  if (unit.empty()) {
    throw io::InputError(
        "input {}: the model does not state the unit that it reads: identify it with --input-unit, "
        "or add \"unit\": \"count\" to it if it is the ADC's counts",
        input.name);
  }
  if (!own) {
    if (known) return counts ? counts_as_they_are() : alpha;
    throw io::InputError(
        "input {:?}: it is in {:?}, the board reads counts: --calibration FILE with \"unit\": "
        "{:?} gives the value of each count",
        input.name, unit, unit);
  }
  if (calibration.unit.empty() && !known) {
    throw io::InputError(
        "{}: add \"unit\": {:?} if that is what its values are in: it is the unit of the model's input {}",
        calibration.source, unit, input.name);
  }
  if (!calibration.unit.empty() && calibration.unit != unit) {
    throw io::InputError("{}: its values are in {:?}, the model's input {} is in {:?}", calibration.source,
                         calibration.unit, input.name, unit);
  }
  return *own;
}

}  // namespace

CalibrationDocument calibration_from_json(const std::string& text, const std::string& source) {
  CalibrationDocument out;
  out.source = source;
  const auto json = io::parse_json(text, source);
  io::JsonReader document(json, out.source);
  document.schema("flexor-calibration", kSchemaVersion);
  out.unit = document.text_or_empty("unit");
  const auto fingers = document.object_or_empty("fingers");
  document.done();
  try {
    for (const auto& item : fingers.items()) {
      const std::size_t i = model::finger_index(item.key());
      if (out.sensor[i])
        document.fail(fmt::format("{} comes twice, by two names; remove one", model::finger_names()[i]));
      io::JsonReader reader(item.value(), fmt::format("{}: {}", out.source, item.key()));
      out.sensor[i] = read_sensor(reader);
    }
  } catch (const io::InputError& error) {
    io::fail_within(source, error);
  }
  return out;
}

CalibrationDocument load_calibration(const std::filesystem::path& path) {
  return calibration_from_json(io::read_document(path), path.string());
}

std::array<Sensor, kFingers> sensors_of(const model::Model& model, const Sensor& alpha,
                                        const CalibrationDocument& calibration) {
  std::array<Sensor, kFingers> out;
  out.fill(alpha);
  const model::Wiring wiring = model::wiring_of(model);
  for (std::size_t i = 0; i < out.size(); ++i)
    if (wiring.input[i]) out[i] = sensor_of(model.inputs[*wiring.input[i]], i, alpha, calibration);
  return out;
}

void fold_corrections(Glove& glove) {
  auto [model, corrections] = model::folded(std::move(glove.model));
  const model::Wiring wiring = model::wiring_of(model);
  for (std::size_t i = 0; i < corrections.size(); ++i) {
    Sensor& sensor = glove.sensor.at(wiring.sensor[i]);
    const model::Correction& one = corrections[i];
    if (one != model::Correction{}) sensor = at_knots([&](double n) { return one(sensor(n)); });
  }
  glove.model = std::move(model);
}

}  // namespace flexor::deploy
