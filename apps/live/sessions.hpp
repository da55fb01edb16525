// Sessions as a folder of plain files, which every other command reads:
//
//   FOLDER/2026-11-24_153012_anna/       one session
//     session.json                       {"schema": "flexor-session", "schema_version": 1, "person", "side", "glove",
//                                         "made", "seconds", "model", "accepted_unix_s", "calibration"}; model: the
//                                         one that was accepted, or null; calibration: one that is open, or null
//     log.csv camera.csv model.json report/ ...
//
// A glove is known by its columns and, where the system has one, the name of its USB adapter, which holds a serial number if
// the adapter has one: two gloves alike on adapters alike cannot be distinguished.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/io/pipe_json.hpp"

namespace flexor::live {

// Of a log that is read whole: eleven hours of five sensors at 100 Hz.
inline constexpr std::uint64_t kMostLogBytes = 256U << 20U;
inline constexpr std::uint64_t kMostModelBytes = 16U << 20U;

struct Session {
  std::string name;
  std::string person;
  std::string side = "right";
  std::string glove;
  std::string made;                       // local time, ISO 8601
  double seconds = 0;                     // of its log; of a recording that was killed: what was written
  std::optional<std::string> model = {};  // file in it; none: none was accepted
  double accepted_unix_s = 0;             // when it was
  // One that is open: what it takes to go on (Calibration::kept); null: none.
  nlohmann::ordered_json calibration = {};
  std::vector<std::string> files = {};  // in it, its folders' reports as FOLDER/report.html; when listed
};
// As session.json has it; its folder has the name.
FLEXOR_PIPE(Session, person, side, glove, made, seconds, model, accepted_unix_s, calibration)

class Sessions {
 public:
  // Makes the folder. Throws io::InputError.
  explicit Sessions(std::filesystem::path root);

  const std::filesystem::path& root() const { return root_; }
  // For as long as it lives no other program holds this session; empty: another one does.
  std::shared_ptr<void> hold(const Session& session) const;
  static constexpr std::size_t kMostListed = 500;
  // Newest first by name, kMostListed at most, with 40 files of each at most. Folders without a session.json that can be read, and is no larger than 8 KiB, are
  // left out, and so are links: nothing is read or written outside the folder.
  std::vector<Session> list() const;
  // A new one with a name of its own, from its time and `person`, or `what` where nobody is named. Throws io::InputError for
  // a name that no folder can have.
  Session create(const std::string& person, const std::string& side, const std::string& glove,
                 const std::string& what);
  void remove(const Session& session) const;  // with all that lies in it
  // Saves it with this model, accepted now, and no calibration that is open.
  void accept(Session& session, const std::string& model) const;
  // Its session.json. Throws io::InputError, io::JobError.
  void save(const Session& session) const;
  std::filesystem::path folder(const Session& session) const { return root_ / session.name; }
  // A file within, whatever the text holds. Throws io::InputError where there is none, or one of more bytes.
  std::filesystem::path file(const std::string& relative, std::uint64_t most_bytes) const;

  // The model that was accepted last for this glove; of `person` alone where one is named.
  std::optional<Session> newest_with_model(const std::string& glove) const;
  // What the wearer calls the columns of a glove that has no names for them (columns.json); empty: nobody was asked.
  std::vector<std::string> column_names(const std::string& glove) const;
  void name_columns(const std::string& glove, const std::vector<std::string>& names) const;

 private:
  std::filesystem::path root_;
};

}  // namespace flexor::live
