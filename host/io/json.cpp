#include "host/io/json.hpp"

namespace flexor::io {

nlohmann::ordered_json parse_json(const std::string& text, const std::string& source) {
  try {
    return nlohmann::ordered_json::parse(text);
  } catch (const nlohmann::ordered_json::out_of_range& error) {
    const std::string what = error.what();
    throw InputError(fmt::format("{}: {}", source, what.substr(what.find("] ") + 2)));
  } catch (const nlohmann::ordered_json::parse_error& error) {
    const std::string what = error.what();
    const auto at = what.find("at line");
    throw InputError(fmt::format("{}: not valid JSON {}; is the file cut off?", source,
                                 at == std::string::npos ? what : what.substr(at, what.find(';') - at)));
  }
}

}  // namespace flexor::io
