// The page's templates inside the program.
#pragma once

#include <string>
#include <string_view>

namespace flexor::report {

// "page.mustache", "blocks.mustache". Throws std::out_of_range for any other name.
std::string page_template(std::string_view name);

}  // namespace flexor::report
