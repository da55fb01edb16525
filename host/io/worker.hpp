// Jobs in programs of their own: one JSON object a line, requests on the program's standard input, answers on its standard
// output. The camera's program, the boards' and `flexor job` speak it.
//
//   to the program    {"job": NAME, "arguments": {...}}
//                     {"cancel": true}                      stops the job that runs, as a progress function would
//   from the program  {"progress": {"stage", "done", "of", "fraction", "seconds_left"}}  null: not known
//                     {"warning": {"kind", "text"}}
//                     {"result": ...}                       or, as the last line of a job,
//                     {"error": {"kind": "input" | "job" | "cancelled" | "doubt", "text": ...}}
//
// One job at a time, any number one after the other; a worker ends when its input has ended and all is done, or once nobody
// reads its output any more, also in the middle of a job. What goes wrong in a worker is thrown here as what it was there:
// InputError, JobError, Cancelled, Doubt.
// Numbers keep their bits. A file name that is no UTF-8 is the list of its bytes.
//
// A worker has the standard error of whoever started it, and with kUserStreams the standard input and output
// too, as its descriptors 14 and 15: jobs then read `-` and write /dev/stdout as if they ran here.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/io/io.hpp"
#include "host/io/process.hpp"

namespace flexor::io {

inline constexpr const char* kUserStreams = "--user-streams";

struct Progress {
  std::string stage;
  std::size_t done = 0;
  std::size_t of = 0;  // 0: not known
  std::optional<double> seconds_left = {};
};
Json to_json(const Progress& progress);

// A worker that runs. Not for several threads at once.
class Worker {
 public:
  // Throws InputError when there is no such program.
  explicit Worker(const std::filesystem::path& program, std::vector<std::string> arguments = {kUserStreams});
  ~Worker();  // ends it, together with its temporaries
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Throws what the job throws; JobError, one line naming program and job, when the worker dies or answers
  // nonsense. Where `progress` gives false, the job is asked to stop. What it throws passes through, and this worker takes
  // no more jobs.
  Json run(const std::string& job, const Json& arguments,
           const std::function<bool(const Progress&)>& progress = {});
  // From any thread, while `run` runs: the program ends soon and leaves nothing half-written.
  void end();
  bool is_usable() const { return process_.has_value() && !busy_; }

 private:
  void send(const Json& line, const std::string& job);
  Json receive(const std::string& job);
  [[noreturn]] void died(const std::string& job);
  [[noreturn]] void refuse_reply(const std::string& job, const std::string& what);

  std::string name_;
  Pipe requests_;
  Pipe replies_;
  std::optional<Process> process_;  // none: it died
  bool busy_ = false;
  std::string received_;
};

// Workers of one program for any number of threads: as many as jobs run at the same time.
class WorkerPool {
 public:
  // Throws InputError when there is no such program.
  explicit WorkerPool(std::filesystem::path program);
  Json run(const std::string& job, const Json& arguments);

 private:
  std::unique_ptr<Worker> take();

  std::filesystem::path program_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Worker>> idle_;
};

// The program of that name in the folder of this one.
std::filesystem::path program_beside(const std::string& name);

// For file names, which are bytes.
Json bytes_to_json(std::string_view bytes);
std::string bytes_from_json(const Json& json);

// The last line of a job: its result, or its error.
Json answer(const std::function<Json()>& job);

// A line before the last one; false: stop.
using Event = std::function<bool(const Json& event)>;
using AnyJob = std::function<Json(const std::string& name, const Json& arguments, const Event& event)>;
// Runs jobs until the standard input ends and all are done; the input is this program's no more, as its standard output.
void serve(bool has_user_streams, const AnyJob& job);

// So much of how much is done (0: not known); false: stop.
using JobProgress = std::function<bool(std::size_t done, std::size_t of)>;
using Job = std::function<Json(const Json& arguments, const JobProgress& progress)>;
// main() of a worker: runs jobs until its input ends; the exit status. With a terminal or --help it prints `what`
// it is in one line.
int serve(int argc, char** argv, const std::string& what, const std::map<std::string, Job>& jobs);

}  // namespace flexor::io
