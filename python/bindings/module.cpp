#include <algorithm>
#include <map>
#include <regex>
#include <string>

#include "host/io/io.hpp"
#include "python/bindings/recording.hpp"

namespace flexor::python {
namespace {

// Rooms name the command's options; here they are arguments. A message that shows a command keeps them.
std::string in_python(const std::string& text) {
  static const std::regex option("--([a-z]+(-[a-z]+)*)");
  static const std::map<std::string, std::string> others = {{"rate", "rate_hz"},
                                                            {"lead", "lead_s"},
                                                            {"clock_offset", "clock_offset_s"},
                                                            {"log_rate", "log_rate_hz"},
                                                            {"time_limit", "time_limit_s"}};
  if (text.find("flexor ") != std::string::npos) return text;
  std::string out;
  auto from = text.begin();
  for (std::sregex_iterator at(text.begin(), text.end(), option), end; at != end; ++at) {
    std::string name = (*at)[1];
    std::ranges::replace(name, '-', '_');
    const auto other = others.find(name);
    out.append(from, (*at)[0].first).append(other == others.end() ? name : other->second);
    from = (*at)[0].second;
  }
  return out.append(from, text.end());
}

template <class Error>
void add_error(nb::module_& m, const char* name, PyObject* base, const char* doc) {
  nb::exception<Error> type(m, name, base);
  type.doc() = doc;
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void* kind) {
        try {
          std::rethrow_exception(thrown);
        } catch (const Error& error) {
          PyErr_SetString(static_cast<PyObject*>(kind), in_python(error.what()).c_str());
        }
      },
      type.ptr());
}

}  // namespace
}  // namespace flexor::python

NB_MODULE(_flexor, m) {
  namespace io = flexor::io;
  namespace nb = nanobind;
  using flexor::python::add_error;
  if (PyInterpreterState_GetID(PyInterpreterState_Get()) != 0) {
    PyErr_SetString(PyExc_ImportError, "flexor cannot be used in a subinterpreter: start a process instead");
    throw nb::python_error();
  }
  add_error<io::InputError>(m, "InputError", PyExc_ValueError,
                            "What was given is wrong: what, where, and the mend.");
  add_error<io::JobError>(m, "JobError", PyExc_RuntimeError,
                          "What was given is well-formed, but tells too little.");
  m.attr("version") = FLEXOR_VERSION;
  flexor::python::add_recording(m);
  flexor::python::add_model(m);
  flexor::python::add_identify(m);
  flexor::python::add_score(m);
  flexor::python::add_twin(m);
  flexor::python::add_posture(m);
}
