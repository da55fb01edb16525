// What each room's file adds to the module.
#pragma once

#include <nanobind/nanobind.h>

namespace flexor::python {

void add_recording(nanobind::module_& m);
void add_model(nanobind::module_& m);
void add_identify(nanobind::module_& m);
void add_score(nanobind::module_& m);
void add_twin(nanobind::module_& m);
void add_posture(nanobind::module_& m);

}  // namespace flexor::python
