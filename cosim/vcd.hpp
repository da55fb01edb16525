// A value change dump (IEEE 1364) of two boards and a world, for GTKWave and its like. Changes may come in
// any order of boards.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace flexor::cosim {

class Vcd {
 public:
  using Signal = std::size_t;

  Signal integer(const std::string& name, int bits);
  Signal real(const std::string& name);

  // Only what differs from the value before is kept.
  void change(std::uint64_t ns, Signal signal, std::int64_t value);
  void change(std::uint64_t ns, Signal signal, std::uint8_t value) {
    change(ns, signal, static_cast<std::int64_t>(value));
  }
  void change(std::uint64_t ns, Signal signal, int value) {
    change(ns, signal, static_cast<std::int64_t>(value));
  }
  void change(std::uint64_t ns, Signal signal, double value);

  std::string text() const;

 private:
  struct Declaration {
    std::string name;
    int bits;  // 0: real
    std::string last;
  };
  void keep(std::uint64_t ns, Signal signal, const std::string& value);

  std::vector<Declaration> signals_;
  std::multimap<std::uint64_t, std::string> changes_;
};

}  // namespace flexor::cosim
