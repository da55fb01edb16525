#include "apps/cli/commands.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/interrupt.hpp"
#include "host/study/bench.hpp"

namespace flexor::cli::wear_command {

struct Options {
  study::BenchOptions bench;
  std::string model = "published-hw";
  double rate_hz = 10;
  std::string motion = "ordinary";
  double slip_deg = 0;
  double for_s = 0;
  std::string key;
  TwinFiles twin;
  bool json = false;
};

void run(Options& o) {
  (void)study::bench_motion(o.motion);
  o.bench.parameters = twin_parameters(o.twin);
  o.bench.model = study::compensator(o.model, o.rate_hz).model;
  study::Bench bench(io::program_beside(kBoardsWorker), o.bench);
  const std::string no_bootloader = study::why_no_bootloader();
  io::StopOnSignal stop;
  if (!o.key.empty()) {
    const std::string kept = deploy::keep_old_key(o.key, *bench.key());
    if (!kept.empty()) log(kept);
    deploy::write_key(o.key, *bench.key());
  }
  print({{{"port", bench.port()},
          {"key", o.key.empty() ? Json(nullptr) : Json(o.key)},
          {"bootloader", no_bootloader.empty()},
          {"rate_hz", o.rate_hz},
          {"seed", o.bench.seed}},
         fmt::format("a glove is at {0}: flexor monitor --port {0}\n", bench.port())},
        o.json);
  if (!o.json && !no_bootloader.empty()) log(no_bootloader);
  const study::BenchChange on = {.worn = {.slip_deg = o.slip_deg}, .motion = o.motion};
  const study::BenchView begin = bench.advance(on);
  while (!*stop.flag()) {
    const study::BenchView now = bench.advance(on);
    if (o.for_s > 0 && static_cast<double>(now.now_ms - begin.now_ms) >= 1000 * o.for_s) return;
  }
}

void add(CLI::App& twin) {
  const auto [o, command] =
      add_command(twin, "wear",
                  "A glove without hardware: both boards simulated in real time with their own firmware, "
                  "worn by the twin, the glove's USB on a pseudo-terminal. Leave it running and use flexor "
                  "monitor, record, send or flash in another terminal. Ctrl-C ends it",
                  run, "one JSON object on standard output, as soon as the glove is there");
  command->add_option("--port-link", o->bench.port_link,
                      "a name for the port that stays (default: the pseudo-terminal's own, /dev/pts/N)");
  add_shown(*command, "--motion", o->motion,
            "what the hand does, again and again: rest, calibration, ordinary, protocol, or 1 to 6 of "
            "the published gestures");
  add_shown(*command, "--slip", o->slip_deg, "every sensor has slipped by so many degrees of bend");
  add_duration(*command, o->for_s);
  add_compensator(*command, o->model, o->rate_hz);
  command->add_option("--key", o->key, "write the pair's key into this file, for flexor send");
  add_seed(*command, o->bench.seed);
  add_twin_options(*command, o->twin);
}

}  // namespace flexor::cli::wear_command
