// Listens to serial ports, one after the other, on a thread of its own: finding a rate and a format takes seconds.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "host/listen/listener.hpp"

namespace flexor::live {

struct FoundPort {
  std::string path;
  std::shared_ptr<listen::Listener> listener;
  std::string trouble;  // without
};

class PortSearch {
 public:
  // Runs it on the server's thread.
  using Post = std::function<void(std::function<void()>)>;
  // On the server's thread; not after `end`.
  struct Hears {
    std::function<void(const std::string& path, const std::string& what)> says;
    std::function<void(const FoundPort&)> found;  // of each port
    std::function<void()> done;
  };

  explicit PortSearch(Post post) : post_(std::move(post)) {}
  ~PortSearch() { end(); }
  PortSearch(const PortSearch&) = delete;
  PortSearch& operator=(const PortSearch&) = delete;

  // With these options, but port and stop. Ends a search that runs.
  void begin(std::vector<std::string> paths, listen::ListenerOptions options, Hears hears);
  void end();
  bool is_running() const { return is_running_; }

 private:
  Post post_;
  std::thread thread_;
  std::shared_ptr<std::atomic<bool>> stops_;
  int search_ = 0;  // the newest; what an older one posted is forgotten
  bool is_running_ = false;
};

}  // namespace flexor::live
