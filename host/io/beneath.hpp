// Files of one folder, whatever a name says.
#pragma once

#include <filesystem>
#include <string_view>

namespace flexor::live {

// A descriptor of the regular file `name` below `folder`, to read; -1 where there is none. No link is followed on the way, each
// part is opened in the one before: nothing that happens to the folder meanwhile leads out of it. The caller closes it.
int open_beneath(const std::filesystem::path& folder, std::string_view name);

}  // namespace flexor::live
