// Whatever one source reads, every source reads: a file, a pipe, a file that is played again, a port.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

#include "host/io/io.hpp"
#include "host/listen/replay_source.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/shapes_test.hpp"

namespace flexor::listen {
namespace {

using recording::Shape;
using Values = std::vector<double>;

// What was read of one column, without what is missing.
Values column_of(const std::vector<std::string>& names, const std::vector<Sample>& samples,
                 const std::string& column) {
  const auto at = std::ranges::find_if(
      names, [&](const std::string& name) { return name == column || name.starts_with(column + "_"); });
  Values out;
  for (const Sample& sample : samples) {
    if (at == names.end()) break;
    const double value = sample.value[static_cast<std::size_t>(at - names.begin())];
    if (!std::isnan(value)) out.push_back(value);
  }
  return out;
}

Values of_pipe(const std::filesystem::path& pipe, const Shape& shape) {
  mkfifo(pipe.c_str(), 0600);
  const std::jthread writer([&] { std::ofstream(pipe, std::ios::binary) << shape.text; });
  recording::CsvReader reader(pipe, {{shape.column}, shape.time});
  return recording::read(reader).column(shape.column).value;
}

Values of_replay(const std::filesystem::path& file, const Shape& shape) {
  ReplaySource source(file, 1000, shape.time);
  std::vector<Sample> samples;
  while (source.wait(0.1, samples) != Event::ended) {
  }
  return column_of(source.columns(), samples, shape.column);
}

Values of_port(const Shape& shape) {
  const auto decoder = make_decoder(Format::lines);
  std::vector<Sample> samples;
  decoder->push({reinterpret_cast<const std::uint8_t*>(shape.text.data()), shape.text.size()}, 0, samples);
  return column_of(decoder->columns(), samples, shape.column);
}

TEST(Sources, ReadEveryShapeAlike) {
  for (const Shape& shape : recording::kShapes) {
    const io::TemporaryFolder folder;
    const auto file = folder.path() / "log.csv";
    io::write_file(file, shape.text);
    EXPECT_EQ(recording::read_csv(file, {shape.column}, shape.time).column(shape.column).value, shape.value)
        << shape.name;
    EXPECT_EQ(of_pipe(folder.path() / "pipe", shape), shape.value) << shape.name;
    EXPECT_EQ(of_replay(file, shape), shape.value) << shape.name;
    EXPECT_EQ(of_port(shape), shape.value) << shape.name << " at a port";
  }
}

}  // namespace
}  // namespace flexor::listen
