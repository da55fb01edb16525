// Figures of an identified joint's samples.
#pragma once

#include "host/report/page.hpp"

namespace flexor::report {

// Of the joint with this number, which their names end in: those of all joints lie in one folder. Throws io::InputError for a table of
// samples without a held-out part; of one without a column `pair` all are of the first.
void joint_figures(Page& page, const Saved& saved, const Json& joint, std::size_t number);

}  // namespace flexor::report
