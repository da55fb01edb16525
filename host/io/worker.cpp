#include "host/io/worker.hpp"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <new>
#include <thread>

#include "host/io/descriptor.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/json.hpp"

namespace flexor::io {
namespace {

constexpr int kUserInput = 14;
constexpr int kUserOutput = 15;

// One line without its end; nothing: the end of the input. `buffer` keeps what came after it. Throws Cancelled, as go_on().
std::optional<std::string> read_line(int descriptor, std::string& buffer) {
  std::size_t searched = 0;
  for (;; go_on()) {
    const std::size_t end = buffer.find('\n', searched);
    if (end != std::string::npos) {
      std::string line = buffer.substr(0, end);
      buffer.erase(0, end + 1);
      return line;
    }
    searched = buffer.size();
    std::array<char, 1 << 16> chunk;
    Waiting ready{descriptor, kToRead, 0};
    if (poll(&ready, 1, -1) < 0) continue;  // a signal
    const ssize_t n = read(descriptor, chunk.data(), chunk.size());
    if (n <= 0) return std::nullopt;
    buffer.append(chunk.data(), static_cast<std::size_t>(n));
  }
}

std::string line_of(const Json& json) { return dump_line(json) + "\n"; }

const Json& cancellation() {
  static const Json json = {{"cancel", true}};
  return json;
}

bool is_cancellation(const std::string& line) {
  constexpr std::size_t kLongest = 64;
  return line.size() < kLongest && Json::parse(line, nullptr, false) == cancellation();
}

[[noreturn]] void throw_error(const Json& error) {
  const std::string kind = error.at("kind").get<std::string>();
  const std::string text = bytes_from_json(error.at("text"));
  if (kind == "input") throw InputError(text);
  if (kind == "cancelled") throw Cancelled(text);
  if (kind == "doubt") throw Doubt(text);
  throw JobError(one_line(text));
}

Json error(const char* kind, std::string_view text) {
  return {{"error", {{"kind", kind}, {"text", bytes_to_json(text)}}}};
}

}  // namespace

std::filesystem::path program_beside(const std::string& name) {
  return this_program().parent_path() / (name + kProgramSuffix);
}

Json answer(const std::function<Json()>& job) {
  try {
    return {{"result", job()}};
  } catch (const InputError& e) {
    return error("input", e.what());
  } catch (const Cancelled& e) {
    return error("cancelled", e.what());
  } catch (const Doubt& e) {
    return error("doubt", e.what());
  } catch (const JobError& e) {
    return error("job", e.what());
  } catch (const std::filesystem::filesystem_error&
               e) {  // behind a folder that is closed to us, or too long a name
    return error("input", fmt::format("{}: cannot be reached: {}", e.path1().string(), e.code().message()));
  } catch (const std::bad_alloc&) {
    return error("job", "out of memory: is the recording's time column in the right unit?");
  } catch (const std::exception& e) {
    return error("job", fmt::format("{}: this is a defect of Flexor, please report it", e.what()));
  }
}

Worker::Worker(const std::filesystem::path& program, std::vector<std::string> arguments)
    : name_(program.filename().string()) {
  if (access(program.c_str(), X_OK) != 0) {
    throw InputError("{} is missing: {}", program.string(), kWorkers);
  }
  std::signal(SIGPIPE, SIG_IGN);  // one that has gone is found by write()
  arguments.insert(arguments.begin(), program.string());
  process_.emplace(program, arguments,
                   std::vector<HandedOn>{{STDIN_FILENO, kUserInput},
                                         {STDOUT_FILENO, kUserOutput},
                                         {requests_.end[0].number(), STDIN_FILENO},
                                         {replies_.end[1].number(), STDOUT_FILENO}});
  requests_.end[0].close();
  replies_.end[1].close();
}

Worker::~Worker() {
  constexpr int kPatience_ms = 2000;
  requests_.end[1].close();
  replies_.end[0].close();
  if (process_) (void)process_->wait_at_most(kPatience_ms);
}

void Worker::end() {
  if (process_) process_->end();
}

void Worker::died(const std::string& job) {
  constexpr int kPatience_ms = 2000;
  const int status = process_->wait_at_most(kPatience_ms);
  process_.reset();
  constexpr int kSignalled = 128;
  throw JobError(
      status > kSignalled
          ? fmt::format("{} was ended by signal {} in the middle of {}", name_, status - kSignalled, job)
          : fmt::format("{} ended with status {} in the middle of {}", name_, status, job));
}

void Worker::refuse_reply(const std::string& job, const std::string& what) {
  process_.reset();
  throw JobError("{} does not answer {} as it should: {}", name_, job, what);
}

void Worker::send(const Json& line, const std::string& job) {
  if (write_all(requests_.end[1].number(), line_of(line)) != 0) died(job);
}

Json Worker::receive(const std::string& job) {
  const std::optional<std::string> line = read_line(replies_.end[0].number(), received_);
  if (!line) died(job);
  try {
    Json reply = parse_json(*line, "its line");
    if (!reply.is_object() || reply.size() != 1) refuse_reply(job, "an object with one member is due");
    return reply;
  } catch (const InputError& error) {
    refuse_reply(job, error.what());
  }
}

Json Worker::run(const std::string& job, const Json& arguments,
                 const std::function<bool(const Progress&)>& progress) {
  if (!is_usable()) throw JobError("{} runs no more: it cannot do {}", name_, job);
  busy_ = true;
  send({{"job", job}, {"arguments", arguments}}, job);
  bool cancelled = false;
  for (;;) {
    Json reply = receive(job);
    try {
      if (reply.contains("warning") || reply.contains("partial")) continue;  // the result has what matters
      if (reply.contains("progress")) {
        const Json& p = reply.at("progress");
        const Json& left = p.at("seconds_left");
        const Progress now{p.at("stage").get<std::string>(), p.at("done").get<std::size_t>(),
                           p.at("of").get<std::size_t>(),
                           left.is_null() ? std::nullopt : std::optional(left.get<double>())};
        if (cancelled || !progress || progress(now)) continue;
        cancelled = true;
        send(cancellation(), job);
        continue;
      }
      busy_ = false;
      if (reply.contains("error")) throw_error(reply.at("error"));
      return std::move(reply.at("result"));
    } catch (const Json::exception& error) {
      refuse_reply(job, error.what());
    }
  }
}

WorkerPool::WorkerPool(std::filesystem::path program) : program_(std::move(program)) {
  idle_.push_back(std::make_unique<Worker>(program_));  // is there, and begins to load
}

std::unique_ptr<Worker> WorkerPool::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<Worker> worker = std::move(idle_.back());
      idle_.pop_back();
      return worker;
    }
  }
  return std::make_unique<Worker>(program_);
}

Json WorkerPool::run(const std::string& job, const Json& arguments) {
  // Goes back whatever the job throws, unless the worker itself has gone.
  struct Lease {
    WorkerPool& pool;
    std::unique_ptr<Worker> worker;
    ~Lease() {
      const std::lock_guard lock(pool.mutex_);
      if (worker->is_usable()) pool.idle_.push_back(std::move(worker));
    }
  };
  const Lease lease{*this, take()};
  return lease.worker->run(job, arguments);
}

namespace {

// The worker's side: a thread reads lines while jobs run, so that a job learns of a cancellation and an end.
class Server {
 public:
  Server(int requests, int replies, const AnyJob& job)
      : requests_(requests), replies_(replies), job_(job), reader_([this] { read(); }) {}

  void run() {
    try {
      for (std::optional<std::string> line; (line = next());) {
        reply(answer([&] { return run(*line); }));
      }
    } catch (const Cancelled&) {  // nobody reads its replies
    }
    note(is_done_);
    if (is_interrupted()) end_by_signal();
  }

 private:
  void read() {
    std::string buffer;
    try {
      while (const std::optional<std::string> line = read_line(requests_, buffer)) take(*line);
      if (!buffer.empty()) take(buffer);
    } catch (const Cancelled&) {
    }
    note(ended_);
    end_with_reader();
  }

  void note(bool& what) {
    const std::lock_guard lock(mutex_);
    what = true;
    arrived_.notify_all();
  }

  void take(const std::string& line) {
    const std::lock_guard lock(mutex_);
    cancelled_ = is_cancellation(line);
    if (cancelled_) return;
    waiting_.push_back(line);
    arrived_.notify_all();
  }

  // No more jobs come; those that came are done, unless nobody reads their replies any more.
  void end_with_reader() {
    constexpr std::chrono::milliseconds kApart(50);
    Waiting replies{replies_, 0, 0};
    std::unique_lock lock(mutex_);
    while (!arrived_.wait_for(lock, kApart, [this] { return is_done_; })) {
      if (poll(&replies, 1, 0) > 0) return interrupt();
    }
  }

  std::optional<std::string> next() {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (waiting_.empty()) return std::nullopt;
    std::string line = std::move(waiting_.front());
    waiting_.pop_front();
    return line;
  }

  // Throws Cancelled: whoever asked has gone.
  void reply(const Json& line) const {
    if (write_all(replies_, line_of(line)) == 0) return;
    interrupt();
    go_on();
  }

  Json run(const std::string& line) {
    const Json request = parse_json(line, "request");
    JsonReader reader(request, "request");
    const std::string name = reader.text("job");
    const Json& arguments = reader.member("arguments");
    reader.done();
    const auto to_reader = [this](const Json& event) {
      reply(event);
      return !cancelled_;
    };
    try {
      return job_(name, arguments, to_reader);
    } catch (const Json::exception& e) {
      throw InputError("request: {}", e.what());
    }
  }

  int requests_;
  int replies_;
  const AnyJob& job_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<std::string> waiting_;
  bool ended_ = false;
  bool is_done_ = false;
  std::atomic<bool> cancelled_ = false;
  std::jthread reader_;
};

// The pipe's end out of the way of what jobs and their programs read and print, and the user's stream, or
// `otherwise`, in its place.
int set_aside(int standard, bool has_user_streams, int users, int otherwise) {
  constexpr int kLeast = 16;
  const int pipe = fcntl(standard, F_DUPFD_CLOEXEC, kLeast);
  (void)dup2(has_user_streams ? users : otherwise, standard);
  if (has_user_streams) close(users);
  return pipe;
}

}  // namespace

void serve(bool has_user_streams, const AnyJob& job) {
  const int nothing = open(kNothing, O_RDONLY | O_CLOEXEC);
  const int requests = set_aside(STDIN_FILENO, has_user_streams, kUserInput, nothing);
  const int replies = set_aside(STDOUT_FILENO, has_user_streams, kUserOutput, STDERR_FILENO);
  Server(requests, replies, job).run();
}

int serve(int argc, char** argv, const std::string& what, const std::map<std::string, Job>& jobs) {
  constexpr int kWrongUse = 2;
  const bool has_user_streams = argc == 2 && std::strcmp(argv[1], kUserStreams) == 0;
  const bool asks = argc == 2 && std::strcmp(argv[1], "--help") == 0;
  if (asks || (argc == 1 && isatty(STDIN_FILENO) != 0)) {
    fmt::print("{}; flexor starts it and speaks to it through pipes\n", what);
    return 0;
  }
  if (argc != 1 && !has_user_streams) {
    fmt::print(stderr, "{}; flexor starts it and speaks to it through pipes\n", what);
    return kWrongUse;
  }
  for (const int ignored : {SIGXFSZ, SIGPIPE, SIGTTIN, SIGTTOU}) std::signal(ignored, SIG_IGN);
  stop_on_signals(false);
  serve(has_user_streams, [&](const std::string& name, const Json& arguments, const Event& event) {
    const auto job = jobs.find(name);
    if (job == jobs.end()) throw InputError("request: no job is called \"{}\"", name);
    auto reported = std::chrono::steady_clock::time_point();
    bool goes_on = true;
    return job->second(arguments, [&](std::size_t done, std::size_t of) {
      constexpr std::chrono::milliseconds kApart(50);
      const auto now = std::chrono::steady_clock::now();
      if (now - reported < kApart) return goes_on;
      reported = now;
      return goes_on = event({{"progress", to_json(Progress{"", done, of, {}})}});
    });
  });
  return 0;
}

}  // namespace flexor::io
