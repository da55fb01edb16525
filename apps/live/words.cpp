#include "apps/live/words.hpp"

namespace flexor::live {

bool is_on(io::JsonReader& parts) {
  const Json& on = parts.member("on");
  if (!on.is_boolean()) parts.fail("\"on\" must be true or false");
  return on.get<bool>();
}

void Words::add(std::map<std::string_view, Word> words, std::map<std::string_view, IsDue> refusals) {
  words_.merge(words);
  refusals_.merge(refusals);
}

void Words::refuse(std::string_view refusal) const {
  if (refusals_.at(refusal)()) throw Refusal(refusal.data());
}

Words::Answer Words::answer(std::string_view message) const {
  Answer out{Json{{"id", nullptr}, {"ok", true}}};
  try {
    const Json json = io::parse_json(std::string(message), "message");
    io::JsonReader parts(json, "message");
    if (parts.has("id")) out.json["id"] = parts.member("id");
    const std::string name = parts.text("do");
    const auto word = words_.find(name);
    if (word == words_.end()) throw io::InputError("\"{}\" is no word that is known", name);
    out.is_silent = word->second.is_silent;
    for (const std::string_view refusal : word->second.refusals) refuse(refusal);
    word->second.act(parts);
  } catch (const std::exception& caught) {
    out.json.update({{"ok", false}, {"error", io::one_line(caught.what())}});
    if (const auto* refusal = dynamic_cast<const Refusal*>(&caught)) out.json.update(refusal->parts);
  }
  return out;
}

}  // namespace flexor::live
