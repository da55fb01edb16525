// Bytes from anybody's port in each of the formats: samples as wide as the columns, in the order of time, and the same ones
// whether the bytes come together or one by one, also where they were cut.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "host/listen/decoder.hpp"

namespace {

using namespace flexor::listen;

void require(bool holds) {
  if (!holds) std::abort();
}

bool is_same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void require_same(const std::vector<Sample>& a, const std::vector<Sample>& b) {
  require(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    require(a[i].board_s == b[i].board_s && a[i].remark == b[i].remark);
    require(std::equal(a[i].value.begin(), a[i].value.end(), b[i].value.begin(), b[i].value.end(), is_same));
  }
}

void decode(Format format, bool readings, std::span<const std::uint8_t> bytes) {
  const auto whole = make_decoder(format, readings);
  const auto parts = make_decoder(format, readings);
  std::vector<Sample> at_once;
  std::vector<Sample> one_by_one;
  whole->push(bytes, 1, at_once);
  for (const std::uint8_t& byte : bytes) parts->push({&byte, 1}, 1, one_by_one);
  whole->cut();
  parts->cut();
  whole->push(bytes, 2, at_once);
  for (const std::uint8_t& byte : bytes) parts->push({&byte, 1}, 2, one_by_one);
  require_same(at_once, one_by_one);
  for (const Sample& sample : at_once) {
    require(sample.value.size() == whole->columns().size());
    require(sample.remark.empty() || sample.remark.size() == sample.value.size());
    require(!sample.board_s || std::isfinite(*sample.board_s));
  }
  require(whole->tally().bytes == 2 * bytes.size());
  require(whole->tally().understood <= 2 * bytes.size());
  require(whole->tally().samples == at_once.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(data, size);
  for (const Format format : {Format::frames, Format::hand, Format::lines}) decode(format, false, bytes);
  decode(Format::frames, true, bytes);
  for (const bool readings : {false, true})
    if (const auto guessed = guess(bytes, readings)) require(guessed->share >= 0.5 && guessed->share <= 1);
  return 0;
}
