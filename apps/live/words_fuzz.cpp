// What a page may send, through a real socket: words a line each, and behind a '#' bytes. Whatever they are, the program goes
// on answering, and every answer is one line. The program stays the same from input to input, so that words meet every step.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "apps/live/live.hpp"
#include "apps/live/test_wire.hpp"
#include "host/io/io.hpp"

namespace {

using namespace flexor;
using Json = nlohmann::json;

// Five fingers that bend and stretch, a sample each time that it is asked.
class Worn : public live::WornGlove {
 public:
  Worn() { facts = {.has_boards = true, .port = "/dev/null", .rate_hz = 100, .lead_s = 0.1}; }
  listen::Event wait(double, std::vector<listen::Sample>& out) override {
    const double t_s = now_s();
    listen::Sample sample{t_s, t_s, std::vector<double>(5, 500 + 300 * std::sin(t_s)), {}};
    out.push_back(std::move(sample));
    return listen::Event::samples;
  }
  const std::vector<std::string>& columns() const override { return columns_; }
  const listen::Tally& tally() const override { return tally_; }
  double now_s() const override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  std::string says() const override { return "a glove"; }
  void set(const live::WornChange&) override {}
  void play(const std::string&, double) override {}
  live::WornNow now() const override { return {}; }
  std::optional<double> begun_s() const override { return 0; }
  void load(const model::Model&) override {}
  Score score() override {
    return [](const live::Jobs::Goes&) { return std::vector<double>(6, 1); };
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::vector<std::string> columns_ = {"thumb", "index", "middle", "ring", "pinky"};
  listen::Tally tally_;
};

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
    out.worn = std::make_shared<Worn>();
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

// Everything is heard in order: what comes before this answer has been dealt with.
bool is_still_there(live::Tab& tab) {
  static int count = 0;
  const std::string id = "fuzz " + std::to_string(++count);
  tab.say(Json{{"id", id}, {"do", "nothing"}}.dump());
  for (;;) {
    const auto [opcode, text] = tab.hear();
    if (opcode == 0 || opcode == live::kClose) return false;
    if (opcode != live::kText) continue;
    const Json heard = Json::parse(text);
    if (heard.contains("error") && heard["error"].get<std::string>().find('\n') != std::string::npos)
      std::abort();
    if (heard.contains("id") && heard["id"] == id) return true;
  }
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
