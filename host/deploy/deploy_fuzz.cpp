// Any bytes as a glove's calibration and as a pair's key: an InputError of one line, or curves that are
// finite and monotonic over all readings, which the boards' tables follow, and a key that reads back.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "host/deploy/calibration.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/fuzz_json.hpp"
#include "host/model/channel.hpp"

namespace {

using namespace flexor;
using io::fuzz::require;

model::Model reads(const std::string& unit) {
  model::Model m;
  m.sample_period_s = 0.05;
  for (const std::string& finger : model::finger_names()) {
    model::Channel c;
    c.name = finger;
    c.input_column = finger;
    c.input_unit = unit.empty() ? "count" : unit;
    c.valid_min = -1e9;
    c.valid_max = 1e9;
    c.saturation = {0, 180};
    model::add(m, c);
  }
  return m;
}

void read_calibration(const std::string& text) {
  const deploy::CalibrationDocument calibration = deploy::calibration_from_json(text, io::fuzz::kSource);
  for (const std::optional<deploy::Sensor>& sensor : calibration.sensor) {
    if (!sensor) continue;
    const bool rises = (*sensor)(sensor::kAdcTop) > (*sensor)(0);
    double last = (*sensor)(0);
    require(std::isfinite(last));
    for (int n = 1; n <= sensor::kAdcTop + 1; ++n) {
      const double value = (*sensor)(n);
      require(std::isfinite(value) && (rises ? value >= last : value <= last));
      last = value;
    }
  }
  deploy::Glove glove;
  glove.model = reads(calibration.unit);
  const deploy::Sensor alpha = deploy::divider(35, 25, 0.5);
  try {
    glove.sensor = deploy::sensors_of(glove.model, alpha, calibration);
  } catch (const io::InputError&) {
    return;  // not every finger of a model in that unit is calibrated
  }
  (void)deploy::glove_tables(glove);
}

void read_key(const std::string& text) {
  if (!deploy::is_key(text)) return;
  if (text.find_first_not_of('0') == std::string::npos) return;  // nobody's key: refused
  const std::string hex = deploy::to_hex(deploy::key_from_hex(text));
  require(deploy::to_hex(deploy::key_from_hex(hex)) == hex);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  io::fuzz::read_or_refuse([&] { read_calibration(text); });
  read_key(text);
  return 0;
}
