#include "cosim/vcd.hpp"

#include <fmt/format.h>

namespace flexor::cosim {
namespace {

// Short names of printable characters, as the format wants them.
std::string code(std::size_t signal) {
  constexpr std::size_t kFirst = 33;
  constexpr std::size_t kBase = 94;
  std::string out(1, static_cast<char>(kFirst + signal % kBase));
  if (signal >= kBase) out += static_cast<char>(kFirst + signal / kBase - 1);
  return out;
}

}  // namespace

Vcd::Signal Vcd::integer(const std::string& name, int bits) {
  signals_.push_back({name, bits, ""});
  return signals_.size() - 1;
}

Vcd::Signal Vcd::real(const std::string& name) { return integer(name, 0); }

void Vcd::change(std::uint64_t ns, Signal signal, std::int64_t value) {
  keep(ns, signal, fmt::format("b{:b} {}", value, code(signal)));
}

void Vcd::change(std::uint64_t ns, Signal signal, double value) {
  keep(ns, signal, fmt::format("r{:.4f} {}", value, code(signal)));
}

void Vcd::keep(std::uint64_t ns, Signal signal, const std::string& value) {
  if (signals_[signal].last == value) return;
  signals_[signal].last = value;
  changes_.emplace(ns, value);
}

std::string Vcd::text() const {
  std::string out = "$timescale 1 ns $end\n$scope module flexor $end\n";
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    const Declaration& s = signals_[i];
    out += fmt::format("$var {} {} {} {} $end\n", s.bits > 0 ? "wire" : "real", s.bits > 0 ? s.bits : 64,
                       code(i), s.name);
  }
  out += "$upscope $end\n$enddefinitions $end\n";
  std::uint64_t now = UINT64_MAX;
  for (const auto& [ns, value] : changes_) {
    if (ns != now) out += fmt::format("#{}\n", ns);
    now = ns;
    out += value + "\n";
  }
  return out;
}

}  // namespace flexor::cosim
