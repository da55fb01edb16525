// Angles as a stream of the Lab Streaming Layer (LSL), which LabRecorder and its like record beside other devices.
//
// The library is loaded when it is needed, from `library`, from FLEXOR_LSL, or as liblsl.so from where the system looks;
// Flexor is built without it. One outlet: a channel for each joint, doubles, degrees; what is not known is NaN. Each
// sample has the caller's time, moved onto LSL's clock by what the two differed at the first sample.
//
// Source: liblsl 1.13 and later, lsl_c.h; XDF's meta-data for motion capture.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "host/export/sink.hpp"

namespace flexor::exports {

struct LslOptions {
  std::string name = "Flexor";
  std::string type = "MoCap";
  std::string source_id;          // the same after a restart: a recorder then goes on
  double rate_hz = 0;             // nominal; 0: irregular
  std::filesystem::path library;  // empty: looked for
};

class LslStream : public Sink {
 public:
  // Throws what require_library() throws, and io::JobError where it makes no stream.
  LslStream(const std::vector<std::string>& joints, const LslOptions& options);
  ~LslStream() override;

  // Throws io::InputError where there is no liblsl, with the mend.
  static void require_library(const LslOptions& options);

  void add(double t_s, std::span<const double> angle_deg) override;
  std::string says() const override;
  bool is_heard() const;  // somebody reads

 private:
  struct Library;
  struct Outlet;
  std::unique_ptr<Library> library_;
  std::unique_ptr<Outlet> outlet_;
};

}  // namespace flexor::exports
