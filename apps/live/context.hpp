// What the parts of the live view share: its options, sessions and server, the page's words, the clock, and how what ran last ended.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/live/outs.hpp"
#include "apps/live/server.hpp"
#include "apps/live/sessions.hpp"
#include "apps/live/words.hpp"
#include "apps/live/worn_glove.hpp"
#include "host/recording/time.hpp"

namespace flexor::live {

struct LiveOptions {
  std::string port = "auto";  // of the glove: what there is, also when it is plugged in later; or a path
  std::filesystem::path devices = "/dev";  // where ports are
  std::string hand;                        // the hand's; empty: with `port` auto, what there is
  unsigned baud = 0;                       // 0: found by listening
  std::string key;                         // file of the pair's key; empty: none
  ServerOptions server;
  std::filesystem::path sessions;
  std::filesystem::path program;  // flexor itself
  std::string model;              // worn from the start; empty: the one that was accepted for this glove
  double rate_hz = 0;             // of models; 0: what suits the glove
  double lead_s = 0;  // of models that are identified: by which what follows the glove comes after it
  std::shared_ptr<WornGlove> worn;
  std::filesystem::path recording;  // played again at first, instead of a port
  recording::TimeOptions time;      // of recordings that are played again
  // What receives the angles of a model's joints, opened when it is worn.
  std::vector<Outs::Open> outs;
};

// On the server's thread. What takes long runs elsewhere and comes back through post().
struct Context {
  // Throws io::InputError.
  Context(LiveOptions given, Handlers handlers)
      : options(std::move(given)),
        sessions(options.sessions),
        server({options.server.port, sessions.root()}, std::move(handlers)) {}

  double wall_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  double now_s() const { return options.worn ? options.worn->now_s() : wall_s(); }
  // Whether the motion that was asked for last has begun, where a twin moves.
  bool has_begun() const { return !options.worn || options.worn->begun_s(); }
  void play(const std::string& motion, double pace = 1) const {
    if (options.worn) options.worn->play(motion, pace);
  }
  // At which a model runs on a glove that gives so many samples a second.
  double model_rate_hz(double glove_hz) const {
    if (options.worn) return options.worn->facts.rate_hz;
    if (options.rate_hz > 0) return options.rate_hz;
    return glove_hz > 90 ? 100 : glove_hz > 45 ? 50 : glove_hz > 18 ? 20 : 10;
  }

  void ended(const std::string& name, bool ok, const std::string& text) {
    last = Json{{"job", name}, {"ok", ok}, {"text", io::one_line(text)}};
    listed_s = -1e9;
  }
  // Whatever fails is reported, and ends nothing else.
  void guard(const char* what, const std::function<void()>& work,
             const std::function<void()>& otherwise = {}) {
    try {
      work();
    } catch (const std::exception& error) {
      if (otherwise) otherwise();
      ended(what, false, error.what());
    }
  }
  void post(const char* what, std::function<void()> work) {
    server.post([this, what, work = std::move(work)] { guard(what, work); });
  }

  LiveOptions options;
  Sessions sessions;
  Words words;
  Server server;
  Json last = nullptr;
  double listed_s = -1e9;  // of wall_s(): when the sessions were listed
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
};

}  // namespace flexor::live
