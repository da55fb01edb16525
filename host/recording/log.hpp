// A log to read: a file or a pipe by its path, or a recording that the caller holds in memory.
#pragma once

#include <concepts>
#include <filesystem>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "host/recording/recording.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/table.hpp"

namespace flexor::recording {

// Of a recording in memory the path is its name alone.
class Log : public std::filesystem::path {
 public:
  Log() = default;
  template <class Path>
  requires(std::convertible_to<Path, std::filesystem::path> && !std::same_as<std::remove_cvref_t<Path>, Log>)
      Log(Path&& path)
      : std::filesystem::path(std::forward<Path>(path)) {}
  explicit Log(Recording held)
      : std::filesystem::path(held.source), memory_(std::make_shared<const Recording>(std::move(held))) {}

  const std::shared_ptr<const Recording>& memory() const { return memory_; }  // null: a file

 private:
  std::shared_ptr<const Recording> memory_;
};

// Rows of a log's columns, which are chosen before the first row is read.
class LogReader : public Source {
 public:
  // Other columns than before; none: all of numbers. Throws io::InputError, listing those there are.
  virtual void choose(const std::vector<std::string>& columns) = 0;
  virtual bool has(const std::string& column) const = 0;
  virtual const std::vector<std::string>& units() const = 0;  // of each column; empty: not stated
  virtual std::string digest() const = 0;
  virtual std::string time_column() const = 0;
  virtual bool splits_by_clock() const { return false; }
};

// Of a recording in memory; NaN is a missing reading. Rows are counted from 1 in messages.
class MemoryReader : public LogReader {
 public:
  MemoryReader(std::shared_ptr<const Recording> recording, const TableOptions& options);

  const std::string& name() const override { return recording_->source; }
  const std::vector<std::string>& columns() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  void choose(const std::vector<std::string>& columns) override;
  bool has(const std::string& column) const override;
  bool next(Row& row) override;
  std::vector<std::string> notes() const override;
  std::string digest() const override { return recording_->digest; }
  std::string time_column() const override { return recording_->time_column; }

 private:
  std::shared_ptr<const Recording> recording_;
  std::vector<const Column*> chosen_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
  std::size_t next_ = 0;
  HoleCounter holes_;
};

std::unique_ptr<LogReader> open_log(const Log& log, const TableOptions& options);

// How the two logs of a pair are read: by kHostClock where both have it and nothing else is asked for.
TimeOptions times_of_pair(const Log& sensor, const Log& reference, TimeOptions time);

}  // namespace flexor::recording
