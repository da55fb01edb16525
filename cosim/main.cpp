// flexor-cosim: firmware on simulated boards, as a worker (host/io/worker.hpp). GPL-3.0-or-later, because it
// links simavr.
#include <map>
#include <memory>

#include "cosim/latency.hpp"
#include "cosim/replay.hpp"
#include "cosim/trace.hpp"
#include "host/io/worker.hpp"
#include "host/study/exact_json.hpp"
#include "host/twin/exact_json.hpp"

namespace {

using namespace flexor;
using Json = nlohmann::ordered_json;

// Of whoever asks: each file is read once.
const cosim::Images& images_of(const Json& arguments) {
  static std::map<std::pair<std::string, std::string>, std::unique_ptr<cosim::Images>> all;
  const Json& json = arguments.at("images");
  const std::pair paths(io::bytes_from_json(json.at("glove")), io::bytes_from_json(json.at("hand")));
  std::unique_ptr<cosim::Images>& images = all[paths];
  if (images == nullptr) {
    images.reset(new cosim::Images{cosim::Firmware(paths.first), cosim::Firmware(paths.second)});
  }
  return *images;
}

Json simulate(const Json& arguments, const io::JobProgress& progress) {
  const cosim::Images& images = images_of(arguments);
  const twin::TrialInput input = twin::trial_input_of(arguments.at("input"));
  const auto first = arguments.at("first").get<std::uint64_t>();
  const auto count = arguments.at("count").get<std::uint64_t>();
  Json out = Json::array();
  for (std::uint64_t t = 0; t < count; ++t) {
    if (!progress(t, count)) throw io::Cancelled("stopped");
    out.push_back(twin::exact_json(cosim::CoSimulation(images, input, first + t).run()));
  }
  return out;
}

Json run_glove(const Json& arguments, const io::JobProgress&) {
  const cosim::Firmware firmware(io::bytes_from_json(arguments.at("elf")));
  return study::exact_json(cosim::replay(firmware, study::glove_of(arguments.at("glove")),
                                         arguments.at("counts").get<study::Counts>()));
}

Json run_hand(const Json& arguments, const io::JobProgress&) {
  const cosim::Firmware firmware(io::bytes_from_json(arguments.at("elf")));
  return study::exact_json(cosim::measure_hand(firmware, study::glove_of(arguments.at("glove")),
                                               arguments.at("seconds").get<double>()));
}

Json latency(const Json& arguments, const io::JobProgress&) {
  return cosim::latency(images_of(arguments), twin::parameters_of(arguments.at("parameters")),
                        model::from_json(arguments.at("model").dump(), "pipe"),
                        arguments.at("edges").get<int>(), arguments.at("seed").get<std::uint64_t>());
}

Json trace(const Json& arguments, const io::JobProgress&) {
  cosim::trace(images_of(arguments), twin::trial_input_of(arguments.at("input")),
               io::bytes_from_json(arguments.at("vcd")));
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  return io::serve(argc, argv, "flexor-cosim: runs the firmware on simulated boards",
                   {{"simulate", simulate},
                    {"run_glove", run_glove},
                    {"run_hand", run_hand},
                    {"latency", latency},
                    {"trace", trace}});
}
