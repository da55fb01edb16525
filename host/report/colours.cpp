#include "host/report/colours.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>

namespace flexor::report {
namespace {

// Colours that stay apart for colour-blind readers (Okabe, Ito 2008; the last four after Tol 2021).
const std::map<std::string, std::string> kFixedColours = {
    {"raw", "#E69F00"},       {"published-w", "#56B4E9"}, {"published-hw", "#D55E00"},
    {"line", "#009E73"},      {"line-lead", "#CC79A7"},   {"published-hw-refitted", "#777777"},
    {"identified", "#332288"}};
constexpr const char* kOthers[] = {"#009E73", "#0072B2", "#CC79A7", "#882255",
                                   "#332288", "#999933", "#777777"};

std::size_t pick(const std::string& name) {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash % std::size(kOthers);
}

}  // namespace

std::vector<std::string> colours_of(const std::vector<std::string>& compensators) {
  std::vector<std::string> out;
  for (const std::string& name : compensators) {
    std::string colour = kFixedColours.contains(name) ? kFixedColours.at(name) : "";
    for (std::size_t tried = 0; colour.empty(); ++tried) {
      const char* const next = kOthers[(pick(name) + tried) % std::size(kOthers)];
      if (tried == std::size(kOthers) || std::ranges::count(out, next) == 0) colour = next;
    }
    out.push_back(std::move(colour));
  }
  return out;
}

}  // namespace flexor::report
