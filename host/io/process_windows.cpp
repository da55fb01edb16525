// The build for Windows starts no other programs yet.

#include "host/io/io.hpp"
#include "host/io/worker.hpp"

namespace flexor::io {
namespace {

[[noreturn]] void refuse(const std::string& program) {
  throw JobError("{}: the build for Windows starts no other programs yet: do this in WSL2", program);
}

}  // namespace

Pipe::Pipe() = default;
Process::~Process() = default;
std::filesystem::path find_program(const std::string&) { return {}; }
ProcessResult run_process(const std::vector<std::string>& argv, const std::filesystem::path&, const Watch&) {
  refuse(argv.front());
}
Worker::Worker(const std::filesystem::path& program, std::vector<std::string>) { refuse(program.string()); }
Worker::~Worker() = default;
Json Worker::run(const std::string& job, const Json&, const std::function<bool(const Progress&)>&) {
  refuse(job);
}
WorkerPool::WorkerPool(std::filesystem::path program) { refuse(program.string()); }
Json WorkerPool::run(const std::string& job, const Json&) { refuse(job); }
std::filesystem::path program_beside(const std::string& name) { return name; }

}  // namespace flexor::io
