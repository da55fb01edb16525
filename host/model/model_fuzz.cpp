// Any bytes as a model: either an InputError, or a document that round-trips and, in every arithmetic that
// can hold it, answers every reading with a finite angle within its limits.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "host/io/fuzz_json.hpp"
#include "host/model/unsafe_reading_test.hpp"

namespace {

template <class Arithmetic>
void run(const flexor::model::Model& model) {
  if (flexor::model::unsafe_reading<Arithmetic>(model)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexor;
  try {
    const model::Model m = model::from_json({reinterpret_cast<const char*>(data), size}, "fuzz");
    if (model::from_json(model::to_json(m), "again") != m) std::abort();
    run<model::DoubleArithmetic>(m);
    run<model::FloatArithmetic>(m);
    run<model::FixedArithmetic>(m);
  } catch (const io::InputError&) {
  }
  return 0;
}
