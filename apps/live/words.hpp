// What a page may ask for: each part of the live view adds its own words, and what may stand in a word's way.
#pragma once

#include <functional>
#include <map>
#include <string_view>
#include <vector>

#include "host/io/json.hpp"

namespace flexor::live {

// What cannot be had now: a kind, of which words.ts has the sentence, and its details.
struct Refusal : io::InputError {
  explicit Refusal(const char* kind, Json known = Json::object())
      : io::InputError(kind), parts(std::move(known)) {}
  Json parts;
};

struct Word {
  std::vector<std::string_view> refusals;  // that there may be, in this order
  std::function<void(io::JsonReader&)>
      act;                 // throws io::InputError or io::JobError: the answer, one line with the mend
  bool is_silent = false;  // it is answered where it fails alone
};

bool is_on(io::JsonReader& parts);  // their "on"

class Words {
 public:
  // Whether it is due; one that has details is thrown.
  using IsDue = std::function<bool()>;

  void add(std::map<std::string_view, Word> words, std::map<std::string_view, IsDue> refusals);
  void refuse(std::string_view refusal) const;  // throws it where it is due
  struct Answer {
    Json json;
    bool is_silent = false;
  };
  Answer answer(std::string_view message) const;  // whatever it holds

 private:
  std::map<std::string_view, Word> words_;
  std::map<std::string_view, IsDue> refusals_;
};

}  // namespace flexor::live
