#include "apps/live/sessions.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <chrono>
#include <ctime>
#include <functional>
#include <map>

#include "host/io/beneath.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::live {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 60;
constexpr std::uint64_t kMostBytes = 1U << 13U;  // of a session.json: twenty times an honest one's
constexpr std::size_t kMostFiles = 40;           // of a session that are listed

void require_plain(const std::string& person) {
  if (io::one_line(person) != person || person.size() > kLongestName || io::to_utf8(person) != person) {
    throw io::InputError("the person's name must be at most {} letters of UTF-8 without line ends",
                         kLongestName);
  }
}

// A link or a FIFO of this name is nobody's of ours.
bool is_plain_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(fs::symlink_status(path, error));
}

// Never through a link to somewhere else, nor into what waits for a reader.
void write_plain(const fs::path& file, const std::string& text) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(file, error)) && !is_plain_file(file))
    throw io::InputError(file.string() + ": is no plain file: remove it");
  io::write_file(file, text);
}

// From the first row of its log to the last whole one.
double written_s(const fs::path& folder) {
  constexpr std::uint64_t kLongestRow = 1U << 14U;
  constexpr std::uint64_t kLongestLog = 1ULL << 40U;
  const io::FileBeneath log(folder, "log.csv", kLongestLog);
  const std::string head = log.read(0, 2 * kLongestRow);
  std::string tail = log.read(log.bytes() - std::min(log.bytes(), 2 * kLongestRow), 2 * kLongestRow);
  const auto time_s = [](const std::string& text, std::size_t line_end) {
    double out = 0;
    std::from_chars(text.data() + std::min(text.size(), line_end + 1), text.data() + text.size(), out);
    return out;
  };
  tail.resize(tail.rfind('\n') + 1);  // half a row
  if (tail.size() < 2) return 0;
  const double seconds = time_s(tail, tail.rfind('\n', tail.size() - 2)) - time_s(head, head.find('\n'));
  return seconds > 0 && seconds < 1e9 ? seconds : 0;  // nan, too
}

// What is no session of ours is left alone.
std::optional<Session> load(const fs::path& folder) {
  try {
    const fs::path file = folder / "session.json";
    Json json = {{"accepted_unix_s", 0}, {"calibration", nullptr}};  // older ones have none
    json.update(io::parse_json(io::FileBeneath(folder, "session.json", kMostBytes).all(), file.string()));
    if (json.at("schema") != "flexor-session" || json.at("schema_version") != 1) return {};
    Session s = json.get<Session>();
    s.name = folder.filename().string();
    require_plain(s.person);
    if (!(s.seconds >= 0 && s.seconds <= 1e9) || s.model.value_or("").find('/') != std::string::npos)
      return {};
    if (s.seconds == 0 && is_plain_file(folder / "log.csv")) s.seconds = written_s(folder);
    return s;
  } catch (const std::exception&) {
    return {};
  }
}

using Columns = std::map<std::string, std::vector<std::string>>;  // names, by the glove

// None of a file that is damaged: they are named again.
Columns columns_in(const fs::path& file) {
  try {
    if (is_plain_file(file)) return io::parse_json(io::read_document(file), file.string()).get<Columns>();
  } catch (const std::exception&) {
  }
  return {};
}

// Its own first.
std::vector<std::string> files_in(const fs::path& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = io::to_utf8(entry.path().filename().string());
    if (is_plain_file(entry.path()) && name != "session.json" && name != "lock") out.push_back(name);
    if (fs::is_directory(entry.symlink_status(error)) && is_plain_file(entry.path() / "report.html"))
      out.push_back(name + "/report.html");
  }
  const auto rank = [](const std::string& name) {
    constexpr std::array kOwn = {"log.csv",     "hand.csv",   "camera.csv",
                                 "markers.csv", "model.json", "report/report.html"};
    return std::ranges::find(kOwn, name) - kOwn.begin();
  };
  std::ranges::sort(out, {}, [&](const std::string& name) { return std::pair(rank(name), name); });
  if (out.size() > kMostFiles) out.resize(kMostFiles);
  return out;
}

}  // namespace

Sessions::Sessions(fs::path root) : root_(std::move(root)) { io::make_folder(root_); }

std::shared_ptr<void> Sessions::hold(const Session& session) const {
  try {
    return std::make_shared<io::FolderLock>(folder(session));
  } catch (const io::InputError&) {
    return {};
  }
}

std::vector<Session> Sessions::list() const {
  std::vector<fs::path> folders;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(root_, error)) {
    if (fs::is_directory(entry.symlink_status(error)))
      folders.push_back(entry.path());  // a link leads elsewhere
  }
  std::ranges::sort(folders, std::greater());
  std::vector<Session> out;
  for (const fs::path& folder : folders) {
    if (out.size() == kMostListed) break;
    std::optional<Session> session = load(folder);
    if (!session) continue;
    session->files = files_in(folder);
    out.push_back(std::move(*session));
  }
  return out;
}

Session Sessions::create(const std::string& person, const std::string& side, const std::string& glove,
                         const std::string& what) {
  require_plain(person);
  Session s;
  s.person = person;
  s.side = side;
  s.glove = glove;
  const std::tm now = fmt::localtime(std::time(nullptr));
  s.made = fmt::format("{:%Y-%m-%dT%H:%M:%S}", now);
  std::string name =
      person.empty() ? what : person;  // letters of every script, digits and what is plain in a path
  std::ranges::replace_if(
      name, [](unsigned char c) { return c < 0x80 && std::isalnum(c) == 0; }, '-');
  const std::string stem = fmt::format("{:%Y-%m-%d_%H%M%S}_{}", now, name);
  s.name = stem;
  io::make_folder(root_);
  std::error_code error;
  for (int n = 2; !fs::create_directory(root_ / s.name, error); ++n) {  // another program may be as quick
    if (error) throw io::InputError("{}: cannot make this folder: {}", root_.string(), error.message());
    s.name = fmt::format("{}-{}", stem, n);
  }
  try {
    save(s);
  } catch (...) {  // nothing is left of what could not be made
    fs::remove_all(root_ / s.name, error);
    throw;
  }
  return s;
}

fs::path Sessions::file(const std::string& relative, std::uint64_t most_bytes) const {
  (void)io::FileBeneath(root_, relative, most_bytes);
  return root_ / relative;
}

void Sessions::remove(const Session& session) const {
  std::error_code error;
  fs::remove_all(folder(session), error);
}

void Sessions::accept(Session& session, const std::string& model) const {
  session.model = model;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  session.accepted_unix_s = std::chrono::duration<double>(now).count();
  session.calibration = nullptr;
  save(session);
}

void Sessions::save(const Session& session) const {
  Json document = {{"schema", "flexor-session"}, {"schema_version", 1}};
  document.update(Json(session));
  write_plain(folder(session) / "session.json", io::dump(document));
}

std::optional<Session> Sessions::newest_with_model(const std::string& glove) const {
  std::optional<Session> newest;  // not by their names, which repeat an hour once a year
  for (Session& s : list()) {
    const bool is_newer = !newest || s.accepted_unix_s > newest->accepted_unix_s;
    if (s.glove == glove && s.model && is_newer) newest = std::move(s);
  }
  return newest;
}

std::vector<std::string> Sessions::column_names(const std::string& glove) const {
  Columns all = columns_in(root_ / "columns.json");
  return std::move(all[glove]);
}

void Sessions::name_columns(const std::string& glove, const std::vector<std::string>& names) const {
  const fs::path file = root_ / "columns.json";
  Columns all = columns_in(file);
  all[glove] = names;
  io::make_folder(root_);
  write_plain(file, io::dump(Json(all)));
}

}  // namespace flexor::live
