// Any bytes as a model: either an InputError, or a document that round-trips and, in every arithmetic that
// can hold it, answers every reading with a finite angle within its limits.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <random>
#include <string>

#include "host/io/io.hpp"
#include "host/model/simulation.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using Json = nlohmann::ordered_json;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Arithmetic>
void run(const flexor::model::Model& model) {
  flexor::model::Simulation<Arithmetic> simulation(model);
  for (std::size_t i = 0; i < simulation.channels(); ++i) {
    const auto& channel = model.channels[i];
    const auto& limits = channel.saturation;
    const auto step = [&](double u) {
      const double y = simulation.step(i, u).angle_deg;  // finite and safe whatever the status says
      if (!(y >= limits.lower_deg - 0.1 && y <= limits.upper_deg + 0.1)) std::abort();
    };
    const double low = channel.valid_min;
    const double high = channel.valid_max;
    for (int round = 0; round < 2; ++round) {
      for (const double u : {low, kNan, high, kInfinity, low, -kInfinity, 1e308, -1e308, high, 0.0, -0.0,
                             1e-308, 1023.0, 512.0, -1e9, 1e9}) {
        step(u);
      }
      constexpr int kRamp = 16;
      for (int k = 0; k <= kRamp; ++k) step(low + (high - low) * k / kRamp);
      for (int k = kRamp; k >= 0; --k) step(k % 3 == 0 ? low : low + (high - low) * k / kRamp);
    }
  }
}

// Every number of a document, at any depth.
void collect(Json& json, std::vector<Json*>& numbers, std::vector<Json*>& lists) {
  if (json.is_number()) numbers.push_back(&json);
  if (json.is_array()) lists.push_back(&json);
  if (!json.is_structured()) return;
  for (Json& child : json) collect(child, numbers, lists);
}

double odd_number(std::mt19937& random, double old) {
  constexpr double kOdd[] = {0,     -1,     1,     1e-300, -1e-300,
                             1e300, -1e300, 1e-12, -1e-12, 1e12,
                             -1e12, 1e9,    -1e9,  1e-9,   1e-5,
                             100,   1000,   -1000, 1023,   32767,
                             2048,  0.05,   1e200, 5e-324, 1.7976931348623157e308,
                             1e-6,  1e5,    -1e3,  7.999,  -7.999,
                             1e38};
  constexpr double kFactors[] = {-1, 2, 0.5, 10, 0.1, 1e3, 1e-3, 1e6, 1 + 1e-9, 1 - 1e-9};
  if (random() % 2 == 0) return kOdd[random() % std::size(kOdd)];
  const double product = old * kFactors[random() % std::size(kFactors)];
  return std::isfinite(product) ? product : 1e300;
}

// Changes a few numbers, or repeats, drops or moves an element of a list.
void change(Json& json, std::mt19937& random) {
  for (unsigned n = 1 + random() % 3; n > 0; --n) {
    std::vector<Json*> numbers;
    std::vector<Json*> lists;
    collect(json, numbers, lists);
    if (!numbers.empty() && random() % 4 != 0) {
      Json& number = *numbers[random() % numbers.size()];
      number = odd_number(random, number.get<double>());
      continue;
    }
    if (lists.empty()) continue;
    Json& list = *lists[random() % lists.size()];
    if (list.empty()) continue;
    const std::size_t at = random() % list.size();
    const std::size_t to = random() % list.size();
    const Json copy = list[at];
    if (random() % 2 == 0) list.erase(at);
    if (random() % 3 != 0)
      list.insert(list.begin() + static_cast<std::ptrdiff_t>(std::min(to, list.size())), copy);
  }
}

}  // namespace

// Half of the inputs are changed as bytes; the other half, where they are JSON, as documents: most bytes of a
// text are quickly refused, most numbers of a document reach the arithmetic.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  std::mt19937 random(seed);
  if (random() % 2 == 0) return LLVMFuzzerMutate(data, size, max_size);
  Json json = Json::parse(data, data + size, nullptr, false);
  if (json.is_discarded()) return LLVMFuzzerMutate(data, size, max_size);
  change(json, random);
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::ranges::copy(text, data);
  return text.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexor;
  try {
    const model::Model m = model::from_json({reinterpret_cast<const char*>(data), size}, "fuzz");
    if (model::from_json(model::to_json(m), "again") != m) std::abort();
    run<model::DoubleArithmetic>(m);
    run<model::FloatArithmetic>(m);
    run<model::FixedArithmetic>(m);
  } catch (const io::InputError&) {
  }
  return 0;
}
