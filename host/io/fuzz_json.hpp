// What the fuzzers of documents share: inputs changed as JSON documents, and what a reader owes its user.
// Only fuzzers and tests include this.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

// Weak: a test that mutates alone has no libFuzzer.
extern "C" [[gnu::weak]] std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size,
                                                      std::size_t max_size);

namespace flexor::io::fuzz {

inline void require(bool good) {
  if (!good) std::abort();
}

inline constexpr const char* kSource = "fuzz";

// Refused in one line of UTF-8 that names the source, or whatever `read` does with what it read.
template <class Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    const std::string what = error.what();
    require(what.starts_with(std::string(kSource) + ": ") && to_utf8(what) == what);
    require(std::ranges::none_of(what, [](unsigned char c) { return c < ' ' || c == 127; }));
  }
}

// Every value of a document, itself included, at any depth, that is `wanted`.
template <class Wanted>
void collect(Json& json, const Wanted& wanted, std::vector<Json*>& out) {
  if (wanted(json)) out.push_back(&json);
  if (!json.is_structured()) return;
  for (Json& child : json) collect(child, wanted, out);
}
template <class Wanted>
std::vector<Json*> all(Json& json, const Wanted& wanted) {
  std::vector<Json*> out;
  collect(json, wanted, out);
  return out;
}

inline double odd_number(std::mt19937& random, double old) {
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
inline void change_numbers(Json& json, std::mt19937& random) {
  for (std::size_t n = 1 + random() % 3; n > 0; --n) {
    const auto numbers = all(json, [](const Json& value) { return value.is_number(); });
    const auto lists = all(json, [](const Json& value) { return value.is_array(); });
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

// Puts one value in another's place, gives a member an odd or another text's name, or drops it.
inline void change_members(Json& json, std::mt19937& random) {
  static const std::string kOdd[] = {"",       "x",     "\n",     "\x1b[2J", std::string("a\0b", 3),
                                     "a,b\"c", "thumb", "little", "1e300",   "\u00e9\u2028"};
  const auto values = all(json, [](const Json&) { return true; });
  const auto any = [&]() -> Json& { return *values[random() % values.size()]; };
  const auto text = [&]() -> std::string {
    const Json& value = any();
    return value.is_string() && random() % 2 == 0 ? value.get<std::string>()
                                                  : kOdd[random() % std::size(kOdd)];
  };
  Json& at = any();
  if (!at.is_object() || at.empty()) {
    const Json other = random() % 2 == 0 ? any() : Json(text());
    at = other;
    return;
  }
  const auto member = std::next(at.begin(), static_cast<std::ptrdiff_t>(random() % at.size()));
  const Json value = *member;
  const std::string name = text();
  if (random() % 2 == 0) at.erase(member);
  if (random() % 3 != 0) at[name] = value;
}

inline void change_anything(Json& json, std::mt19937& random) {
  if (random() % 3 == 0) {
    change_members(json, random);
  } else {
    change_numbers(json, random);
  }
}

}  // namespace flexor::io::fuzz

// Half of the inputs are changed as bytes; the other half, where they are JSON, as documents: most bytes of a
// text are quickly refused, most numbers of a document reach the arithmetic. Whatever includes this header is
// mutated so; libFuzzer calls it by its name.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using flexor::Json;
  std::mt19937 random(seed);
  if (random() % 2 == 0) return LLVMFuzzerMutate(data, size, max_size);
  Json json = Json::parse(data, data + size, nullptr, false);
  if (json.is_discarded()) return LLVMFuzzerMutate(data, size, max_size);
  flexor::io::fuzz::change_anything(json, random);
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::ranges::copy(text, data);
  return text.size();
}
