// Jobs: commands of `flexor` in processes of their own, one at a time.

#include "apps/live/live.hpp"

namespace flexor::live {

namespace {

// In one line: the result page lists those of a calibration.
std::string in_words(const std::vector<std::string>& warnings) {
  if (warnings.empty()) return "done";
  if (warnings.size() == 1) return "done. " + warnings.front();
  return fmt::format("done, with {} warnings", warnings.size());
}

// Of each compensator the mean errors of the six gestures together.
nlohmann::ordered_json totals_of(const nlohmann::ordered_json& cells) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const auto& cell : cells) {
    const auto& mean = cell.at("total_error_deg_s").at("mean");
    if (cell.at("gesture") == 1)
      out.push_back({{"compensator", cell.at("compensator")}, {"total_deg_s", 0.0}});
    for (auto& total : out) {
      if (total.at("compensator") == cell.at("compensator") && mean.is_number())
        total["total_deg_s"] = total["total_deg_s"].get<double>() + mean.get<double>();
    }
  }
  return out;
}

}  // namespace

Jobs::Done Live::ending(const std::string& name, Jobs::Done done) {
  last_ = nullptr;
  return [this, name, done = std::move(done)](const JobResult& result) {
    ended(name, result.ok, result.ok ? in_words(result.warnings()) : result.text);
    done(result);
    send_state();
  };
}

void Live::start(const std::string& name, const Json& request, Jobs::Done done) {
  refuse("job_runs");
  jobs_.run_command(name, request, ending(name, std::move(done)));
}

void Live::ended(const std::string& name, bool ok, const std::string& text) {
  last_ = Json{{"job", name}, {"ok", ok}, {"text", io::one_line(text)}};
  listed_s_ = -1e9;
}

// Programs that speak with a board need its port for themselves; a recording goes on afterwards, as after a pulled plug.
void Live::start_without_glove(const std::string& name, const Json& request, Jobs::Done done) {
  refuse("job_runs");
  glove_->let_go();
  start(name, request, std::move(done));
}

void Live::send(io::JsonReader&) {
  if (options_.worn && !options_.worn->facts.has_boards) {
    options_.worn->load(*model_);
    if (calibration_) calibration_->sent();
    return ended("send", true, "the twin's glove runs it");
  }
  const listen::Source* source = glove_->source();
  if (glove_->port().empty()) throw Refusal("no_board", {{"board", "glove"}});
  if (source && !source->takes_models()) throw Refusal("takes_no_models");
  Json request = {{"model_or_folder", model_->path.string()},
                  {"port", options_.worn ? options_.worn->facts.port : glove_->port()}};
  const std::string key = options_.worn ? options_.worn->facts.key_file : options_.key;
  if (!key.empty()) request["key"] = key;
  if (source && source->baud() > 0) request["baud"] = source->baud();
  // The glove says its own: on a radio fewer frames come than it takes samples.
  if (options_.worn || options_.rate_hz > 0) request["rate"] = model_rate_hz(link_rate_hz());
  start_without_glove("send", request, [this](const JobResult& result) {
    if (result.ok && calibration_) calibration_->sent();
  });
}

// The model that is worn, as firmware of its own; then through the board's bootloader.
void Live::flash(io::JsonReader& parts) {
  const std::string board = parts.text("board");
  if (board != "glove" && board != "hand") parts.fail("\"board\" must be glove or hand");
  if (!model_) throw Refusal("no_model");
  if (options_.worn && !options_.worn->facts.why_not_written.empty())
    throw io::InputError(options_.worn->facts.why_not_written);
  const std::string hand = glove_->hand ? glove_->hand->path : "";
  const std::string port = parts.has("port") ? parts.text("port") : board == "hand" ? hand : glove_->port();
  if (port.empty()) throw Refusal("no_board", {{"board", board}});
  // One folder for good, so that the pair keeps its key; the server does not show it.
  const std::string folder = (sessions_.root() / ".firmware").string();
  const Json flash = {{"folder_or_hex", folder}, {"board", board}, {"port", port}};
  Json deploy = {{"model", model_->path.string()}, {"out", folder}};
  // A board that says nothing yet gets the model's own.
  if (options_.worn || options_.rate_hz > 0 || link_rate_hz() > 0)
    deploy["rate"] = model_rate_hz(link_rate_hz());
  if (!options_.key.empty()) deploy["key"] = options_.key;
  const listen::Source* source = glove_->source();
  if (source && source->baud() > 0) deploy["baud"] = source->baud();
  start("deploy", deploy, [this, flash](const JobResult& result) {
    if (!result.ok) return;
    try {
      start_without_glove("flash", flash, [](const JobResult&) {});
    } catch (const std::exception& error) {
      ended("flash", false, error.what());
    }
  });
}

void Live::score_run(io::JsonReader& parts) {
  if (calibration_ && calibration_->step() == Step::motion) throw Refusal("motion_runs");
  const std::string label = parts.text_or_empty("label").substr(0, 40);
  const auto keep = [this, label](const JobResult& result) {
    if (!result.ok) return;
    double total_deg_s = 0;
    for (const Json& gesture_deg_s : result.json) total_deg_s += gesture_deg_s.get<double>();
    scores_.push_back({{"label", label}, {"total_deg_s", total_deg_s}, {"gestures_deg_s", result.json}});
  };
  jobs_.run("score", "six gestures", options_.worn->score(), ending("score", keep));
}

void Live::experiment_run(io::JsonReader& parts) {
  const int trials = parts.whole_within("trials", 1, 10000);
  const bool is_compared = model_ && model_->joints.size() == twin::kFingers;
  const Session session = new_session("experiment");
  Json compensators = {"raw", "published-w", "published-hw"};
  if (is_compared) compensators.push_back(model_->path.string());
  start("experiment",
        {{"trials", trials},
         {"compensators", std::move(compensators)},
         {"out", (sessions_.folder(session) / "experiment").string()}},
        [this](const JobResult& result) {
          if (result.ok) experiment_ = totals_of(result.json.at("cells"));
        });
}

}  // namespace flexor::live
