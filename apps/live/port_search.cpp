#include "apps/live/port_search.hpp"

#include <exception>
#include <utility>

namespace flexor::live {
namespace {

FoundPort find(listen::ListenerOptions options, const std::function<void(const std::string&)>& says) {
  const std::string path = options.port;
  try {
    return {path, std::make_shared<listen::Listener>(std::move(options), says), ""};
  } catch (const std::exception& error) {
    return {path, nullptr, error.what()};
  }
}

}  // namespace

void PortSearch::begin(std::vector<std::string> paths, listen::ListenerOptions options, Hears hears) {
  end();
  is_running_ = true;
  stops_ = std::make_shared<std::atomic<bool>>(false);
  options.stop = stops_;
  const auto post = [this, search = search_](std::function<void()> work) {
    post_([this, search, work = std::move(work)] {
      if (search == search_) work();
    });
  };
  thread_ = std::thread([this, post, paths = std::move(paths), options = std::move(options),
                         hears = std::move(hears)]() mutable {
    for (const std::string& path : paths) {
      options.port = path;
      const FoundPort found = find(
          options, [&](const std::string& what) { post([hears, path, what] { hears.says(path, what); }); });
      post([hears, found] { hears.found(found); });
    }
    post([this, hears] {
      is_running_ = false;
      hears.done();
    });
  });
}

void PortSearch::end() {
  ++search_;
  is_running_ = false;
  if (stops_) *stops_ = true;
  if (thread_.joinable()) thread_.join();
}

}  // namespace flexor::live
