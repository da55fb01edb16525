// A worker for worker_test: jobs that end in every way in which a job can end.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <new>
#include <thread>

#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"
#include "host/io/output.hpp"
#include "host/io/worker.hpp"

namespace {

using flexor::Json;
using flexor::io::JobProgress;

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

// Counts, and keeps what it has when it is asked to stop.
Json count(const Json& arguments, const JobProgress& progress) {
  const auto of = arguments.at("of").get<std::size_t>();
  for (std::size_t done = 0; done < of; ++done) {
    if (!progress(done, of)) return {{"counted", done}, {"stopped", true}};
    pause_ms(arguments.value("pause_ms", 0));
  }
  return {{"counted", of}, {"stopped", false}};
}

Json fail(const Json& arguments, const JobProgress&) {
  const auto kind = arguments.at("kind").get<std::string>();
  const std::string message = flexor::io::bytes_from_json(arguments.at("message"));
  if (kind == "input") throw flexor::io::InputError(message);
  if (kind == "job") throw flexor::io::JobError(message);
  if (kind == "cancelled") throw flexor::io::Cancelled(message);
  if (kind == "memory") throw std::bad_alloc();
  throw std::logic_error(message);
}

// Half of a file and a folder, and then nothing more.
Json half(const Json& arguments, const JobProgress&) {
  const flexor::io::TemporaryFolder folder;
  flexor::io::Output output(arguments.at("out").get<std::string>());
  output.write(std::string(1 << 20, 'x'));
  flexor::io::write_file(arguments.at("ready").get<std::string>(), folder.path().string());
  for (;; pause_ms(1)) flexor::io::go_on();
}

Json die(const Json& arguments, const JobProgress&) {
  (void)std::raise(arguments.at("signal").get<int>());
  std::_Exit(arguments.value("status", 3));
}

// Another program's line in place of the answer: the highest descriptor is the pipe's.
Json babble(const Json& arguments, const JobProgress&) {
  const std::string text = arguments.at("text").get<std::string>() + "\n";
  constexpr int kHighest = 64;
  for (int descriptor = kHighest; descriptor > 2; --descriptor) {
    if (::write(descriptor, text.data(), text.size()) > 0) break;
  }
  for (;;) ::pause();
}

// A board that does not play: no trials, whatever is asked for.
Json simulate(const Json&, const JobProgress&) { return Json::array(); }

// From the user's standard input to the user's standard output.
Json copy(const Json&, const JobProgress&) {
  const std::string text = flexor::io::read_file("-");
  (void)std::fputs(text.c_str(), stdout);
  (void)std::fflush(stdout);
  return text.size();
}

}  // namespace

int main(int argc, char** argv) {
  return flexor::io::serve(argc, argv, "test_worker: a worker for tests",
                           {{"echo", [](const Json& arguments, const JobProgress&) { return arguments; }},
                            {"count", count},
                            {"fail", fail},
                            {"half", half},
                            {"die", die},
                            {"babble", babble},
                            {"simulate", simulate},
                            {"copy", copy}});
}
