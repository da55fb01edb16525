// What a page asked for and cannot have now: a kind, of which words.ts has the sentence, and what there is to say of it.
#pragma once

#include <nlohmann/json.hpp>

#include "host/io/io.hpp"

namespace flexor::live {

struct Refusal : io::InputError {
  explicit Refusal(const char* kind, nlohmann::ordered_json known = nlohmann::ordered_json::object())
      : io::InputError(kind), parts(std::move(known)) {}
  nlohmann::ordered_json parts;
};

}  // namespace flexor::live
