// flexor-cosim: firmware on simulated boards, as a worker (host/io/worker.hpp). GPL-3.0-or-later, because it
// links simavr.
#include <memory>

#include "cosim/bench.hpp"
#include "cosim/latency.hpp"
#include "cosim/replay.hpp"
#include "host/io/worker.hpp"
#include "host/study/exact_json.hpp"

namespace {

using namespace flexor;

Json simulate(const Json& arguments, const io::JobProgress& progress) {
  const auto input = arguments.at("input").get<twin::TrialInput>();
  const cosim::Images images(
      study::twin_glove(input),
      deploy::unprotected_hand(input.parameters, input.compensator, study::bench_key()));
  const auto first = arguments.at("first").get<std::uint64_t>();
  const auto count = arguments.at("count").get<std::uint64_t>();
  Json out = Json::array();
  for (std::uint64_t t = 0; t < count; ++t) {
    if (!progress(t, count)) throw io::Cancelled("stopped");
    out.push_back(cosim::CoSimulation(images, input, first + t).run());
  }
  return out;
}

Json run_glove(const Json& arguments, const io::JobProgress&) {
  return cosim::replay(arguments.at("glove").get<deploy::Glove>(),
                       arguments.at("counts").get<study::Counts>());
}

Json run_hand(const Json& arguments, const io::JobProgress&) {
  const deploy::Glove glove = arguments.at("glove").get<deploy::Glove>();
  const model::Hardware hardware = model::hardware_of(arguments.at("hardware"), "pipe");
  return cosim::measure_hand(deploy::safe_hand(hardware, glove.model, glove.key),
                             arguments.at("seconds").get<double>());
}

Json latency(const Json& arguments, const io::JobProgress&) {
  return cosim::latency(arguments.at("parameters").get<twin::Parameters>(),
                        arguments.at("model").get<model::Model>(), arguments.at("edges").get<int>(),
                        arguments.at("seed").get<std::uint64_t>());
}

std::unique_ptr<cosim::Bench> bench;  // one at a time

cosim::Bench& open_bench() {
  if (bench == nullptr) throw io::InputError("no bench is open: bench_open comes first");
  return *bench;
}

std::filesystem::path path_or_none(const Json& arguments, const char* name) {
  return arguments.contains(name) ? io::bytes_from_json(arguments.at(name)) : std::string();
}

Json bench_open(const Json& arguments, const io::JobProgress&) {
  bench.reset();
  bench = std::make_unique<cosim::Bench>(
      cosim::BenchSetup{arguments.at("glove").get<deploy::Glove>(), path_or_none(arguments, "bootloader"),
                        arguments.at("input").get<twin::TrialInput>(), path_or_none(arguments, "link")});
  return {{"port", bench->terminal()}};
}

Json bench_advance(const Json& arguments, const io::JobProgress&) {
  return open_bench().advance(arguments.get<study::BenchChange>());
}

Json bench_score(const Json& arguments, const io::JobProgress& progress) {
  return open_bench().score(arguments.at("gestures").get<std::vector<int>>(), progress);
}

Json bench_close(const Json&, const io::JobProgress&) {
  bench.reset();
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  return io::serve(argc, argv, "flexor-cosim: runs the firmware on simulated boards",
                   {{"simulate", simulate},
                    {"run_glove", run_glove},
                    {"run_hand", run_hand},
                    {"latency", latency},
                    {"bench_open", bench_open},
                    {"bench_advance", bench_advance},
                    {"bench_score", bench_score},
                    {"bench_close", bench_close}});
}
