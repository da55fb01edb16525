// What a page may send, through a real socket: words a line each, and behind a '#' bytes. Whatever they are, the program goes
// on answering, and every answer is one line. The program stays the same from input to input, so that words meet every step.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <thread>

#include "apps/live/live.hpp"
#include "apps/live/test_wire.hpp"
#include "apps/live/twin_source.hpp"
#include "host/io/io.hpp"

namespace {

using namespace flexor;
using Json = nlohmann::json;

class Running {
 public:
  Running() : live_(options(folder_.path())), place(live_.url()), thread_([this] { live_.run(stop_); }) {}
  ~Running() {
    stop_ = true;
    thread_.join();
  }

 private:
  static live::LiveOptions options(const std::filesystem::path& folder) {
    live::LiveOptions out;
    out.sessions = folder / "sessions";
    out.program = "/bin/false";
    const auto worn = std::make_shared<live::TwinSource>(live::TwinOptions{.pace = 0});
    worn->facts.has_boards = true;
    worn->facts.port = "/dev/null";
    out.worn = worn;
    return out;
  }
  io::TemporaryFolder folder_;
  std::atomic<bool> stop_ = false;
  live::Live live_;

 public:
  live::Place place;

 private:
  std::thread thread_;
};

// Everything is answered in order: what comes before this answer has been dealt with.
bool is_still_there(live::Tab& tab) {
  static int count = 0;
  const std::string id = "fuzz " + std::to_string(++count);
  tab.send(Json{{"id", id}, {"do", "nothing"}}.dump());
  Json answer;
  do {
    answer = tab.receive_json();
    if (answer.is_null()) return false;
    if (answer.value("error", "").find('\n') != std::string::npos) std::abort();
  } while (answer.value("id", Json()) != id);
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::optional<Running> running;
  if (!running) running.emplace();
  live::Tab tab(running->place);
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const bool is_binary = line.starts_with('#');
    tab.put(live::frame(is_binary ? live::kBinary : live::kText, is_binary ? line.substr(1) : line));
  }
  // Text that is no UTF-8 ends its own socket, and no other.
  if (!is_still_there(tab)) {
    live::Tab other(running->place);
    if (!is_still_there(other)) std::abort();
  }
  // At the program's end the server's thread ends before the constants that it met here are destroyed.
  std::atexit([] { running.reset(); });
  return 0;
}
