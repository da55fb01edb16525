#include "host/deploy/calibration.hpp"

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::deploy {
namespace {

constexpr int kSchemaVersion = 1;

bool increasing(const std::vector<double>& x) {
  return std::ranges::adjacent_find(x, std::greater_equal<>()) == x.end();
}

}  // namespace

std::array<Sensor, kFingers> load_calibration(const std::filesystem::path& path,
                                              std::array<Sensor, kFingers> sensors) {
  const std::string source = path.string();
  const auto json = io::parse_json(io::read_file(path), source);
  io::JsonReader document(json, source);
  if (document.text("schema") != "flexor-calibration")
    document.fail("\"schema\" must be \"flexor-calibration\"");
  if (document.number("schema_version") != kSchemaVersion)
    document.fail(fmt::format("schema_version must be {}", kSchemaVersion));
  const auto fingers = document.object_or_empty("fingers");
  document.done();
  const auto& names = model::finger_names();
  for (const auto& item : fingers.items()) {
    const auto i =
        static_cast<std::size_t>(std::ranges::find(names, model::finger(item.key())) - names.begin());
    io::JsonReader reader(item.value(), fmt::format("{}: {}", source, item.key()));
    const std::vector<double> counts = reader.numbers("counts");
    const std::vector<double> value = reader.numbers("value");
    reader.done();
    if (counts.size() < 2 || counts.size() != value.size())
      reader.fail("needs at least two points, as many \"counts\" as \"value\"");
    if (!increasing(counts) || counts.front() < 0 || counts.back() > sensor::kAdcTop) {
      reader.fail(fmt::format("\"counts\" must increase, from 0 to at most {}", sensor::kAdcTop));
    }
    const std::vector<double> falling(value.rbegin(), value.rend());
    if (!increasing(value) && !increasing(falling)) reader.fail("\"value\" must rise or fall throughout");
    sensors[i] = through_points(counts, value);
  }
  return sensors;
}

}  // namespace flexor::deploy
