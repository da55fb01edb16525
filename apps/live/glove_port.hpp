// Where readings come from: every state of the glove and each transition in one place, the search over the ports there are,
// and the bionic hand that it finds beside the glove.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/live/context.hpp"
#include "apps/live/hand_port.hpp"
#include "host/listen/listener.hpp"
#include "host/listen/replay_source.hpp"
#include "host/listen/source.hpp"

namespace flexor::live {

enum class DeviceState {
  none,           // nobody is there: somebody is looked for
  left,           // a person disconnected: nobody is looked for
  listening,      // to ports, one after the other
  doubtful,       // likewise, after one that sends nothing that is known
  misunderstood,  // at the end of that
  glove,
  gone,  // unplugged: it is looked for
  replay,
  worn,  // by the twin
};

enum class DeviceEvent { drops, leaves, listens, misunderstands, ends, speaks, goes, returns, plays, wears };

DeviceState after(DeviceState state, DeviceEvent event);

// As SOCKET.md has it, but for gloves of the twin.
const char* name_of(DeviceState state);

// On the server's thread.
class GlovePort {
 public:
  struct Calls {
    std::function<void()> is_readable;  // receive() has something to give
    std::function<void()> drops;        // the source has gone for good
  };

  // Adds its words. Throws io::InputError where the key cannot be read.
  GlovePort(Context& context, Calls calls);
  ~GlovePort() { end_search(); }

  DeviceState state() const { return state_; }
  std::string port() const { return state_ == DeviceState::replay ? "" : port_; }
  listen::Source* source() const { return source_.get(); }  // null: none
  listen::ReplaySource* replay() const;                     // null: it is none
  std::string misfit() const;                               // why nothing of what comes is taken; "": it is
  bool is_gone() const { return state_ == DeviceState::gone; }
  // By which it is known again: its columns and, where the system has one, the name of its adapter.
  std::string id(const std::vector<std::string>& columns) const;
  void write(Json& state) const;
  Json wrong() const;  // what to do, as SOCKET.md has it: of what went wrong; null: nothing did
  Json next() const;   // likewise, until a glove is connected

  void begin();   // by the options. Throws io::InputError
  void look();    // for what has been plugged in
  void let_go();  // for another program's sake, until the next receive()
  // Appends what came, on the server's clock; whether more may be ready. Never waits.
  bool receive(std::vector<listen::Sample>& out);

  std::optional<HandPort> hand;

 private:
  void connect(const std::string& port);  // chosen by a person; throws io::InputError
  void leave();                           // the glove; a replay: back to who was there
  // In place of who is there. Throws io::InputError.
  void attach(std::shared_ptr<listen::Source> source, const std::string& port, DeviceEvent event);
  void play(const std::filesystem::path& file, const std::string& name);
  std::vector<std::string> named() const;
  std::vector<std::string> free(std::vector<std::string> ports) const;
  void listen_to(std::vector<std::string> paths, bool is_chosen);
  void search(std::vector<std::string> paths, listen::ListenerOptions options, bool is_chosen);
  void end_search();
  void found(const std::string& path, std::shared_ptr<listen::Listener> listener, bool is_chosen);
  void found_nothing(const std::string& why, bool is_chosen);
  void searched();
  void become(DeviceEvent event, std::string status);
  void detach();
  void watch(int descriptor);

  Context& context_;
  LiveOptions& options_;
  Calls calls_;
  decltype(listen::ListenerOptions::key) key_;
  DeviceState state_ = DeviceState::none;
  std::string status_;
  std::string port_;      // the glove's, also while a recording is played again
  std::string replayed_;  // what that is called
  std::shared_ptr<listen::Source> source_;
  double begin_s_ = 0;  // the server's clock when the source's was 0
  int watched_ = -1;
  std::shared_ptr<void> watch_;
  double named_tried_s_ = -1e9;
  std::vector<std::string> tried_ports_;
  // Listens to ports, one after the other: finding a rate and a format takes seconds.
  std::jthread search_;
  std::shared_ptr<std::atomic<bool>> search_stops_;  // of the search that runs; null: none does
};

}  // namespace flexor::live
