#include "host/study/cohort.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "host/deploy/model_block.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/json.hpp"
#include "host/io/output.hpp"
#include "host/io/run_in_order.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/line_format.hpp"
#include "host/recording/unit.hpp"
#include "host/study/journal.hpp"
#include "host/study/shards.hpp"

namespace flexor::study {
namespace {

namespace fs = std::filesystem;
using io::InputError;

enum Column : std::size_t { kSubject, kSession, kGlove, kReference, kMap, kOwnColumns };
constexpr std::array kNames = {"subject", "session", "glove", "reference", "map"};

constexpr const char* kFiles = "files_digest";
constexpr const char* kWarnings = "warnings";

using Cells = std::vector<std::string>;

// What a take's joint and what a left out person's has in the table: columns and cells.
std::vector<std::pair<std::string, std::string>> scores_of(const identify::ScoreRow& row,
                                                           const score::Verdict& verdict) {
  const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; };
  const auto bound = [&](double value) { return verdict.has_interval ? number(value) : ""; };
  std::vector<std::pair<std::string, std::string>> out = {{"samples", fmt::format("{}", row.samples)},
                                                          {"rmse_deg", number(row.rmse_deg)},
                                                          {"rmse_low_deg", bound(verdict.rmse_low_deg)},
                                                          {"rmse_high_deg", bound(verdict.rmse_high_deg)}};
  for (const score::Baseline& one : score::kBaselines) {
    const auto found = row.baseline_deg.find(one.name);
    out.emplace_back(fmt::format("{}_deg", one.name),
                     found == row.baseline_deg.end() ? "" : number(found->second));
  }
  const bool compared = verdict.has_interval && !verdict.baseline.empty();
  out.emplace_back("verdict", compared ? score::to_json(verdict).at("word").get<std::string>() : "");
  out.emplace_back("baseline", verdict.baseline);
  out.emplace_back("difference_low_deg", compared ? number(verdict.low_deg) : "");
  out.emplace_back("difference_high_deg", compared ? number(verdict.high_deg) : "");
  return out;
}

Cells score_columns(const std::string& prefix) {
  Cells out;
  for (const auto& [column, cell] : scores_of({}, {})) out.push_back(prefix + column);
  return out;
}

void add_scores(Cells& to, const identify::ScoreRow& row, const score::Verdict& verdict) {
  for (auto& [column, cell] : scores_of(row, verdict)) to.push_back(cell);
}

std::string line_of(const Cells& cells) {
  std::string out;
  for (const std::string& cell : cells) out += (&cell == cells.data() ? "" : ",") + recording::quoted(cell);
  return out + "\n";
}

// Where each of our own columns stands, and then the covariates.
std::vector<std::size_t> columns_of(const Cells& header, const std::string& source) {
  const auto fail = [&](const std::string& what) {
    throw InputError("{}, row 1: {}; a manifest has the columns {}, the last may be left out", source, what,
                     fmt::join(kNames, ","));
  };
  std::vector<std::size_t> out;
  for (const char* name : kNames) {
    const auto at = std::ranges::find(header, name, recording::lower);
    if (at == header.end() && name != kNames[kMap]) fail(fmt::format("column \"{}\" is missing", name));
    out.push_back(static_cast<std::size_t>(at - header.begin()));  // without maps, behind the last
  }
  std::set<std::string> taken = {"joint", "structure", "warnings", "reason"};
  for (const char* prefix : {"", "left_out_"})
    for (const std::string& name : score_columns(prefix)) taken.insert(name);
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (header[i].empty() && i == 0) continue;  // pandas' index
    if (header[i].empty()) fail(fmt::format("column {} has no name", i + 1));
    if (out[kMap] == header.size() && header[i].size() < 5 && recording::lower(header[i]).starts_with("map"))
      fail(fmt::format("is \"{}\" the column \"map\"?", header[i]));
    if (!taken.insert(header[i]).second)
      fail(fmt::format("\"{}\" is there twice, or a column of the table that is written", header[i]));
    if (std::ranges::find(out, i) == out.end()) out.push_back(i);
  }
  return out;
}

// The text of a map, where the cell is a file's name that file's.
std::string map_of(const std::string& cell, const fs::path& folder) {
  if (cell.empty() || cell.find('=') != std::string::npos) return cell;
  const std::string text = io::read_document(folder / cell);
  return text.substr(0, text.find_last_not_of(" \r\n") + 1);
}

std::string model_file(const std::string& subject, const std::string& session) {
  std::string name = subject + "_" + session;
  std::ranges::replace_if(
      name, [](char c) { return std::strchr("<>:\"|?*", c) != nullptr; }, '_');  // Windows' own
  return fmt::format("models/{}.json", name);
}

// A row's files and map. `rows`: those before it by their model's name. Throws io::InputError: what is wrong with it.
void fill(Take& take, Cells cells, const std::vector<std::size_t>& columns, std::size_t header,
          const fs::path& folder, const std::string& place, std::map<std::string, std::size_t>& rows) {
  const auto fail = [&](std::size_t column, const std::string& what) {
    throw InputError("{}, column \"{}\": {}", place, kNames[column], what);
  };
  const auto within = [&](std::size_t column, const auto& work) {
    try {
      work();
    } catch (const InputError& error) {
      fail(column, error.what());
    }
  };
  const auto [other, is_new] =
      rows.emplace(recording::lower(model_file(take.subject, take.session)), take.row);
  if (!is_new && !take.subject.empty())
    fail(kSession,
         fmt::format("subject \"{}\" and session \"{}\" are those of row {}, or their model's file is",
                     take.subject, take.session, other->second));
  if (cells.size() != header)
    throw InputError("{}: has {} cells, the header {}", place, cells.size(), header);
  cells.resize(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string& cell = cells[columns[i]];
    if (std::ranges::any_of(cell, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7f; }))
      throw InputError("{}, column {}: bytes that are no text", place, columns[i] + 1);
    if (i < kMap && cell.empty()) fail(i, "is empty");
    if (i <= kSession && (cell.front() == '.' || cell.find_first_of("/\\") != std::string::npos))
      fail(i, fmt::format("\"{}\" cannot be a part of a file's name", cell));
  }
  for (const std::size_t i : {kGlove, kReference}) {
    const fs::path file = folder / cells[columns[i]];
    (i == kGlove ? take.files.sensor : take.files.reference) = file;
    within(i, [&] {
      io::require_readable(file);
      if (!fs::is_regular_file(file))  // a pipe can be read once
        throw InputError(file.string() + ": is no file that stays: write it into one");
      take.digest = io::digest(take.digest + io::read_file(file));
    });
    io::note_input(file);
  }
  within(kMap, [&] {
    take.map = map_of(cells[columns[kMap]], folder);
    if (!take.map.empty()) (void)identify::parse_map(take.map);
  });
}

// Names in the table and in messages are the manifest's own, wherever that lies.
std::string reason_of(const std::string& text, const fs::path& folder) {
  std::string out = io::to_utf8(io::one_line(text));
  const std::string prefix = io::to_utf8((folder / "").string());
  for (std::size_t at = 0; folder != "" && (at = out.find(prefix, at)) != std::string::npos;)
    out.erase(at, prefix.size());
  return out;
}

fs::path part_file(const fs::path& folder, std::size_t job) {
  return folder / "rows" / fmt::format("{}.json", job + 1);
}

// What a job leaves: of each of "joints" its cells, or the "reason" why there are none; null: nothing yet.
Json read_part(const fs::path& folder, std::size_t job) {
  const fs::path file = part_file(folder, job);
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  Json part = io::parse_json(io::read_document(file), file.string());
  try {
    (void)part.at("reason").get<std::string>();
    (void)part.at("joints").get<std::map<std::string, Cells>>();
    return part;
  } catch (const Json::exception&) {
    throw InputError(file.string() + ": is damaged: remove it, and give the same command again");
  }
}

Json settings_of(const identify::Request& o) {
  Json ends = Json::object();
  for (const auto& [joint, of] : o.ends) ends[joint] = {of.open_deg, of.fist_deg};
  const auto digest = [](const auto& model) {
    return model ? Json(io::digest(model::to_json(*model))) : Json(nullptr);
  };
  return {{"rate_hz", o.rate_hz},
          {"split", o.split},
          {"structure", o.structure},
          {"refit", o.refit},
          {"initial", digest(o.initial)},
          {"fit_all", o.fit_all},
          {"lead_s", o.lead_s},
          {"clock_offset_s", o.clock_offset_s ? Json(*o.clock_offset_s) : Json(nullptr)},
          {"reference_error_deg", o.reference_error_deg},
          {"ends_deg", std::move(ends)},
          {"units", {o.input_unit, o.output_unit, o.time.unit}},
          {"time_columns", o.time.columns},
          {"log_rate_hz", o.time.log_rate_hz},
          {"segments", o.time.segments},
          {"leave_out", o.leave_out == identify::LeaveOut::person ? "person" : ""}};
}

class Run {
 public:
  explicit Run(const CohortRequest& request) : request_(request), takes_(request.manifest.takes) {
    Json takes = Json::array();
    for (std::size_t t = 0; t < takes_.size(); ++t) {
      const Take& take = takes_[t];
      Json person;
      if (request.options.leave_out == identify::LeaveOut::person && take.fault.empty()) {
        auto at = std::ranges::find_if(persons_, [&](const auto& theirs) {
          return takes_[theirs.front()].subject == take.subject && takes_[theirs.front()].map == take.map;
        });
        if (at == persons_.end()) at = persons_.emplace(at);
        at->push_back(t);
        person = at - persons_.begin();
      }
      takes.push_back({{"row", take.row},
                       {"subject", take.subject},
                       {"session", take.session},
                       {"covariates", take.covariates},
                       {kFiles, take.digest},
                       {"person", std::move(person)}});
    }
    settings_ = {{"kind", "cohort"},
                 {"version", FLEXOR_VERSION},
                 {"manifest", request.manifest.digest},
                 {"options", settings_of(request.options)},
                 {"covariates", request.manifest.covariates},
                 {"takes", std::move(takes)},
                 {"persons", persons_.size()}};
    if (request.shard.of > 1) settings_["shard"] = request.shard;
  }

  const Json& settings() const { return settings_; }
  bool is_stopped() const { return request_.goes_on && !request_.goes_on(); }

  // Writes what it finds.
  void do_job(std::size_t job, int threads) const {
    Json part = {{"reason", ""}, {"joints", Json::object()}, {kWarnings, Json::array()}};
    try {
      job < takes_.size() ? identify(takes_[job], threads, part)
                          : leave_out(persons_[job - takes_.size()], threads, part["joints"]);
    } catch (const io::Failure& error) {
      part["reason"] = reason_of(error.what(), request_.manifest.folder);
    }
    if (is_stopped()) throw io::Cancelled("");  // it may be the best so far only
    io::write_file(part_file(request_.folder, job), io::dump(part));
  }

 private:
  identify::Request request_of(const Take& take, int threads) const {
    identify::Request out = request_.options;
    out.leave_out = identify::LeaveOut::none;
    out.room = deploy::share_of_room;
    out.threads = threads;
    out.pairs = {take.files};
    out.map = take.map.empty() ? identify::map_by_name(take.files, out.time) : identify::parse_map(take.map);
    return out;
  }

  identify::Step step() const {
    return [this](std::size_t, std::size_t, const std::string&) { return !is_stopped(); };
  }

  void identify(const Take& take, int threads, Json& part) const {
    if (!take.fault.empty()) throw InputError(take.fault);
    const identify::Result found = identify::identify_files(request_of(take, threads), step());
    if (is_stopped()) return;
    // The model first: a row shows that it is there.
    model::save(found.model, request_.folder / model_file(take.subject, take.session));
    for (const std::string& warning : found.warnings)
      part[kWarnings].push_back(reason_of(warning, request_.manifest.folder));
    for (const identify::JointResult& joint : found.joints) {
      Cells cells = {joint.structure};
      add_scores(cells, joint.all(), joint.verdict);
      part["joints"][joint.name] = cells;
    }
  }

  void leave_out(const std::vector<std::size_t>& person, int threads, Json& joints) const {
    const Take& first = takes_[person.front()];
    identify::Request all = request_of(first, threads);
    all.pairs.clear();
    std::vector<std::size_t> own;
    for (const Take& take : takes_) {
      if (!take.fault.empty() || take.map != first.map) continue;
      if (take.subject == first.subject) own.push_back(all.pairs.size());
      all.pairs.push_back(take.files);
    }
    if (own.size() == all.pairs.size()) {
      std::set<std::size_t> others;
      for (const Take& take : takes_)
        if (take.fault.empty() && take.map != first.map) others.insert(take.row);
      throw io::JobError(
          others.empty() ? fmt::format("without {} nobody is left", first.subject)
                         : fmt::format("without {} nobody is left whose map is \"{}\": it differs in row {}",
                                       first.subject, first.map, fmt::join(others, ", ")));
    }
    try {
      for (const identify::LeftOut& one : identify::leave_person_out(all, own, step())) {
        Cells cells;
        add_scores(cells, one.row, one.verdict);
        joints[one.row.name] = cells;
      }
    } catch (const io::JobError& error) {
      throw io::JobError("without {}: {}", first.subject, error.what());
    }
  }

  const CohortRequest& request_;
  const std::vector<Take>& takes_;
  std::vector<std::vector<std::size_t>> persons_;  // of each its takes of one map
  Json settings_;
};

// From a folder in which all rows are.
void write_table(const fs::path& folder, const Json& settings) {
  const bool has_left_out = settings.at("persons") > 0;
  const std::size_t scores = 1 + score_columns("").size();
  const std::size_t left_out = has_left_out ? scores - 1 : 0;
  const auto add = [](Cells& to, const Cells& cells, std::size_t count) {
    to.insert(to.end(), cells.begin(), cells.end());
    to.resize(to.size() + count - cells.size());
  };
  io::Output out(folder / "cohort.csv");
  Cells header = {"subject", "session"};
  const auto covariates = settings.at("covariates").get<Cells>();
  add(header, covariates, covariates.size());
  add(header, {"joint", "structure"}, 2);
  add(header, score_columns(""), scores - 1);
  if (has_left_out) add(header, score_columns("left_out_"), left_out);
  add(header, {kWarnings, "reason"}, 2);
  out.write(line_of(header));
  const Json& takes = settings.at("takes");
  for (std::size_t t = 0; t < takes.size(); ++t) {
    const Json& take = takes[t];
    Json part = read_part(folder, t);
    Json person = {{"reason", ""}, {"joints", Json::object()}};
    if (!take.at("person").is_null())
      person = read_part(folder, takes.size() + take.at("person").get<std::size_t>());
    if (part.at("joints").empty()) part["joints"][""] = Cells();
    for (const auto& [joint, cells] : part.at("joints").items()) {
      Cells row = {take.at("subject"), take.at("session")};
      add(row, take.at("covariates"), covariates.size());
      row.push_back(joint);
      add(row, cells, scores);
      if (has_left_out) add(row, person.at("joints").value(joint, Cells()), left_out);
      row.push_back(fmt::format("{}", fmt::join(part.value(kWarnings, Cells()), "; ")));
      row.push_back((part.at("reason") == "" ? person : part).at("reason"));
      out.write(line_of(row));
    }
  }
  out.commit();
}

std::string name_of(const Json& settings, std::size_t job) {
  const Json& takes = settings.at("takes");
  if (job < takes.size())
    return fmt::format("row {} ({} {})", takes[job].at("row").get<std::size_t>(),
                       takes[job].at("subject").get<std::string>(),
                       takes[job].at("session").get<std::string>());
  const auto at =
      std::ranges::find_if(takes, [&](const Json& take) { return take.at("person") == job - takes.size(); });
  return fmt::format("{} left out", at->at("subject").get<std::string>());
}

std::size_t jobs_of(const Json& settings) {
  return settings.at("takes").size() + settings.at("persons").get<std::size_t>();
}

bool is_of_cohort(const Json& settings) {
  return settings.is_object() && settings.value("kind", Json()) == "cohort";
}

// Of a shard's rows and models.
std::string digest_of(const fs::path& folder, const Json& settings, const Shard& shard) {
  const Json& takes = settings.at("takes");
  std::string out;
  for (std::size_t k = 0; k < shard.count(jobs_of(settings)); ++k) {
    const std::size_t job = shard.item(k);
    out = io::digest(out.append(io::read_file(part_file(folder, job))));
    if (job < takes.size() && !read_part(folder, job).at("joints").empty())
      out = io::digest(
          out.append(io::read_file(folder / model_file(takes[job].at("subject"), takes[job].at("session")))));
  }
  return out;
}

// What was made of logs that were changed since; of whom is left out all, for it is made of everybody's.
void remove_outdated(const fs::path& folder, const Json& settings) {
  std::ifstream file(folder / "run.json");
  Json there = Json::parse(file, nullptr, false);
  if (!is_of_cohort(there) || there.value("takes", Json()).size() != settings.at("takes").size()) return;
  std::vector<std::size_t> outdated;
  for (std::size_t t = 0; t < settings.at("takes").size(); ++t) {
    Json& digest = there["takes"][t][kFiles];
    if (digest == settings.at("takes")[t].at(kFiles)) continue;
    digest = settings.at("takes")[t].at(kFiles);
    outdated.push_back(t);
  }
  if (outdated.empty() || !is_same_run(there, settings)) return;
  for (const std::size_t t : outdated)
    fs::remove(folder / model_file(there["takes"][t].at("subject"), there["takes"][t].at("session")));
  for (std::size_t job = settings.at("takes").size(); job < jobs_of(settings); ++job) outdated.push_back(job);
  for (const std::size_t job : outdated) fs::remove(part_file(folder, job));
  io::write_file(folder / "run.json", io::dump(settings));
}

void start_folder(const fs::path& folder, const Json& settings) {
  io::require_writable(folder / "cohort.csv");
  remove_outdated(folder, settings);
  if (!is_same_run(folder, settings)) io::write_file(folder / "run.json", io::dump(settings));
  for (const char* inner : {"rows", "models"}) io::make_folder(folder / inner);
}

}  // namespace

Manifest read_manifest(const fs::path& path) {
  const std::string bytes = io::read_file(path);
  const std::string source = io::to_utf8(path.filename().string());
  io::note_input(path);
  Manifest out{path.parent_path(), bytes, {}, {}};
  std::istringstream stream(bytes);
  recording::LineReader lines(stream, source, false);
  std::string line;
  std::string more;
  Cells cells;
  std::vector<std::size_t> columns;
  std::size_t header = 0;
  std::map<std::string, std::size_t> rows;  // by the model's name, and by what its logs hold
  char separator = ',';
  while (lines.next(line)) {
    if (line.find_first_not_of(" \t,;") == std::string::npos) continue;
    if (columns.empty() && line.starts_with("sep=")) continue;  // as Excel writes it
    const std::size_t row = lines.number();
    if (columns.empty()) separator = recording::separator_of(line);
    bool is_open = false;
    while ((is_open = recording::split(line, separator, cells)) && lines.next(more)) line += ' ' + more;
    while (cells.size() > std::max<std::size_t>(header, 1) && cells.back().empty()) cells.pop_back();
    if (columns.empty()) {
      header = cells.size();
      columns = columns_of(cells, source);
      for (std::size_t i = kOwnColumns; i < columns.size(); ++i) out.covariates.push_back(cells[columns[i]]);
      continue;
    }
    Take& take = out.takes.emplace_back();
    take.row = row;
    const auto cell = [&](std::size_t i) {
      return columns[i] < cells.size() ? io::to_utf8(io::one_line(cells[columns[i]])) : "";
    };
    take.subject = cell(kSubject);
    take.session = cell(kSession);
    for (std::size_t i = kOwnColumns; i < columns.size(); ++i) take.covariates.push_back(cell(i));
    const std::string place = fmt::format("{}, row {}", source, row);
    try {
      if (is_open) throw InputError(place + ": a quote is not closed");
      fill(take, cells, columns, header, out.folder, place, rows);
      if (const auto [of, is_new] = rows.emplace(take.digest + take.map, row); !is_new)
        throw InputError("{}: its logs and map are those of row {}", place, of->second);
      out.digest += take.map;
    } catch (const InputError& error) {
      take.fault = reason_of(error.what(), out.folder);
    }
  }
  if (out.takes.empty())
    throw InputError("{}: no row: a header with {} and a row for each session", source,
                     fmt::join(kNames, ","));
  out.digest = io::digest(out.digest);
  return out;
}

CohortResult run_cohort(const CohortRequest& request,
                        const std::function<void(std::size_t done, std::size_t of)>& progress) {
  const io::FolderLock lock(request.folder, "cohort");
  const Run run(request);
  start_folder(request.folder, run.settings());
  const Shard& shard = request.shard;
  const std::size_t mine = shard.count(jobs_of(run.settings()));
  std::vector<std::size_t> todo;
  bool is_whole = true;
  for (std::size_t k = 0; k < mine; ++k) {
    const Json part = read_part(request.folder, shard.item(k));
    if (part.is_null() || part.at("joints").empty()) todo.push_back(shard.item(k));
    is_whole = is_whole && !part.is_null();
  }
  if (is_sealed(request.folder)) {
    require_sealed(request.folder, is_whole ? digest_of(request.folder, run.settings(), shard) : "");
    if (!todo.empty()) io::write_file(request.folder / "run.json", io::dump(run.settings()));
  }
  const int threads = io::threads_of(request.threads);
  const int inner = std::max(1, threads / std::max(1, static_cast<int>(todo.size())));
  try {
    io::run_in_order<char>(
        0, todo.size(), threads,
        [&](std::size_t k) {
          run.do_job(todo[k], inner);
          return char();
        },
        [&](std::size_t k, char) {
          if (progress) progress(k + 1, todo.size());
        });
  } catch (const io::Cancelled&) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < mine; ++k) kept += fs::exists(part_file(request.folder, shard.item(k)));
    throw io::Cancelled("stopped: {} of {} rows are kept in {}, and the same command goes on from there",
                        kept, mine, request.folder.string());
  }
  if (shard.of == 1)
    write_table(request.folder, run.settings());
  else
    seal(request.folder, run.settings(), digest_of(request.folder, run.settings(), shard));
  CohortResult out;
  for (std::size_t k = 0; k < mine && shard.item(k) < request.manifest.takes.size(); ++k, ++out.takes) {
    const Json part = read_part(request.folder, shard.item(k));
    if (part.at("joints").empty())
      out.failed.push_back(fmt::format("{}: {}", name_of(run.settings(), shard.item(k)),
                                       part.at("reason").get<std::string>()));
    out.warned += part.value(kWarnings, Cells()).empty() ? 0 : 1;
  }
  return out;
}

bool is_cohort(const fs::path& folder) {
  const fs::path file = folder / "run.json";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return false;
  return is_of_cohort(io::parse_json(io::read_document(file), file.string()));
}

void merge_cohort(const std::vector<fs::path>& parts, const fs::path& out) {
  const auto [settings, folders] = find_shards(parts, "folder of flexor identify --manifest", is_of_cohort);
  Cells missing;
  const auto folder_of = [&, &shards = folders](std::size_t job) { return shards[job % shards.size()]; };
  for (std::size_t job = 0; job < jobs_of(settings); ++job)
    if (folder_of(job).empty() || !fs::exists(part_file(folder_of(job), job)))
      missing.push_back(fmt::format("{} of shard {}", name_of(settings, job), job % folders.size() + 1));
  if (!missing.empty())
    throw InputError("{} missing: {}: give their folders too, or their commands again",
                     missing.size() > 1 ? "rows are" : "a row is", recording::listed(missing));
  for (std::size_t i = 0; i < folders.size(); ++i)  // of more shards than rows some need not be there
    if (folders.size() > 1 && !folders[i].empty())
      require_sealed(folders[i], digest_of(folders[i], settings, {i + 1, folders.size()}));
  const io::FolderLock lock(out, "cohort");
  start_folder(out, settings);
  for (std::size_t job = 0; job < jobs_of(settings); ++job) {
    const fs::path from = folder_of(job);
    const Json part = read_part(from, job);
    if (job < settings.at("takes").size() && !part.at("joints").empty()) {
      const Json& take = settings.at("takes")[job];
      const std::string model = model_file(take.at("subject"), take.at("session"));
      io::write_file(out / model, io::read_file(from / model));
    }
    io::write_file(part_file(out, job), io::dump(part));
  }
  write_table(out, settings);
}

}  // namespace flexor::study
