#include "host/study/journal.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

constexpr const char* kSeal = "rows_digest";

std::uintmax_t size_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

std::string seal_of(const fs::path& folder) {
  const fs::path path = folder / "run.json";
  return io::parse_json(io::read_document(path), path.string()).value(kSeal, "");
}

}  // namespace

Journal::Journal(const fs::path& folder, const std::string& settings, const std::string& header)
    : folder_(folder), path_(folder / "trials.csv"), header_(header) {
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_regular_file(path_, error)) {
    throw io::InputError(fmt::format("{}: is no ordinary file; choose another folder", path_.string()));
  }
  old_.open(path_, std::ios::binary);
  std::string line;
  const bool whole = old_.is_open() && std::getline(old_, line) && !old_.eof();
  if (whole && line + "\n" != header) {
    throw io::InputError(
        fmt::format("{}: its columns are not those of this version of Flexor: choose another "
                    "folder or remove it",
                    path_.string()));
  }
  require_same_run(settings, header);
  if (whole) kept_bytes_ = read_bytes_ = header.size();
}

bool is_same_run(const fs::path& folder, const std::string& settings) {
  const fs::path path = folder / "run.json";
  if (size_of(path) == 0) return false;
  const std::string text = io::read_file(path);
  auto there = nlohmann::ordered_json::parse(text, nullptr, false);
  if (there.is_object()) there.erase(kSeal);
  if (text == settings || io::dump(there) == settings) return true;
  throw io::InputError(
      fmt::format("{} holds the results of other settings (see run.json there): choose another folder "
                  "or remove it",
                  folder.string()));
}

void seal(const fs::path& folder, const std::string& settings, const std::string& digest) {
  if (is_sealed(folder)) return require_sealed(folder, digest);
  auto json = nlohmann::ordered_json::parse(settings);
  json[kSeal] = digest;
  io::write_file(folder / "run.json", io::dump(json));
}

bool is_sealed(const fs::path& folder) { return !seal_of(folder).empty(); }

void require_sealed(const fs::path& folder, const std::string& digest) {
  const std::string there = seal_of(folder);
  if (there == digest) return;
  if (there.empty())
    throw io::InputError(
        fmt::format("{}: its run has not ended: give that shard's command once more, it goes on from there",
                    folder.string()));
  throw io::InputError(
      fmt::format("{}: its rows are not those that its run ended with: give that shard's command into a new "
                  "folder",
                  folder.string()));
}

void Journal::require_same_run(const std::string& settings, const std::string& header) {
  if (is_same_run(folder_, settings)) return;
  // run.json is written first: rows without it are somebody else's.
  if (size_of(path_) > header.size()) {
    throw io::InputError(
        fmt::format("{}: no run.json beside it says what these rows are: choose another folder or remove it",
                    path_.string()));
  }
  io::write_file(folder_ / "run.json", settings);
}

bool Journal::next(std::string& row) {
  if (kept_bytes_ == 0 || !std::getline(old_, row) || old_.eof()) return false;
  read_bytes_ += row.size() + 1;
  return true;
}

void Journal::start() {
  old_.close();
  file_.emplace(path_, kept_bytes_);
  if (kept_bytes_ == 0) file_->append(header_);
}

}  // namespace flexor::study
