// An OpenSim motion file (.mot): what OpenSim's GUI, its Storage and its TimeSeriesTable read.
//
// Times and angles are the shortest texts that read back to the same numbers; degrees. A joint's name is a coordinate's
// in OpenSim: blanks in it become underscores. A row with an angle that is not known is left out: OpenSim's Storage reads no further.
#pragma once

#include <filesystem>

#include "host/export/angles.hpp"

namespace flexor::exports {

// Reads the recording twice, since the file begins with its number of rows. Throws io::InputError and io::JobError.
Written write_mot(const std::filesystem::path& recording, const AngleOptions& angles,
                  const std::filesystem::path& out);

}  // namespace flexor::exports
