#include "apps/live/job_runner.hpp"

#include <fmt/format.h>

namespace flexor::live {
namespace {

// In one line: the result page lists those of a calibration.
std::string in_words(const std::vector<std::string>& warnings) {
  if (warnings.empty()) return "done";
  if (warnings.size() == 1) return "done. " + warnings.front();
  return fmt::format("done, with {} warnings", warnings.size());
}

// Of each compensator the mean errors of the six gestures together.
Json totals_of(const Json& cells) {
  Json out = Json::array();
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

JobRunner::JobRunner(Context& context, GlovePort& glove, Worn& worn)
    : Jobs(context.options.program,
           [&context](std::function<void()> work) { context.post("job", std::move(work)); }),
      context_(context),
      glove_(glove),
      worn_(worn) {
  context_.words.add(
      {{"job.cancel", {{}, [this](io::JsonReader&) { cancel(); }}},
       {"flash", {{}, [this](io::JsonReader& parts) { flash(parts); }}},
       {"score.run",
        {{"no_twin", "recording_runs", "job_runs", "motion_runs"},
         [this](io::JsonReader& parts) { run_score(parts.text_or_empty("label").substr(0, 40)); }}},
       {"experiment.run",
        {{"job_runs"},
         [this](io::JsonReader& parts) { run_experiment(parts.whole_within("trials", 1, 10000)); }}}},
      {{"job_runs", [this] {
          require_none();
          context_.words.refuse("anew_runs");
          return false;
        }}});
}

Jobs::Done JobRunner::ending(const std::string& name, Done done) {
  context_.last = nullptr;
  return [this, name, done = std::move(done)](const JobResult& result) {
    context_.ended(name, result.ok, result.ok ? in_words(result.warnings()) : result.text);
    done(result);
  };
}

void JobRunner::start(const std::string& name, const Json& request, Done done) {
  context_.words.refuse("job_runs");
  run_command(name, request, ending(name, std::move(done)));
}

// Programs that speak with a board need its port for themselves; a recording goes on afterwards, as after a pulled plug.
void JobRunner::start_without_glove(const std::string& name, const Json& request, Done done) {
  context_.words.refuse("job_runs");
  glove_.let_go();
  start(name, request, std::move(done));
}

void JobRunner::send(const std::function<void()>& sent) {
  const auto& [worn, options] = std::tie(context_.options.worn, context_.options);
  if (worn && !worn->facts.has_boards) {
    worn->load(*worn_.model());
    sent();
    return context_.ended("send", true, "the twin's glove runs it");
  }
  const listen::Source* source = glove_.source();
  if (glove_.port().empty()) throw Refusal("no_board", {{"board", "glove"}});
  if (source && !source->takes_models()) throw Refusal("takes_no_models");
  Json request = {{"model_or_folder", worn_.model()->path.string()},
                  {"port", worn ? worn->facts.port : glove_.port()}};
  const std::string key = worn ? worn->facts.key_file : options.key;
  if (!key.empty()) request["key"] = key;
  if (source && source->baud() > 0) request["baud"] = source->baud();
  // The glove reports its own: on a radio fewer frames come than it takes samples.
  if (worn || options.rate_hz > 0) request["rate"] = context_.model_rate_hz(worn_.stream.rate_hz());
  start_without_glove("send", request, [sent](const JobResult& result) {
    if (result.ok) sent();
  });
}

// The model that is worn, as firmware of its own; then through the board's bootloader.
void JobRunner::flash(io::JsonReader& parts) {
  const auto& [worn, options] = std::tie(context_.options.worn, context_.options);
  const std::string board = parts.text("board");
  if (board != "glove" && board != "hand") parts.fail("\"board\" must be glove or hand");
  if (!worn_.model()) throw Refusal("no_model");
  if (worn && !worn->facts.why_not_written.empty()) throw io::InputError(worn->facts.why_not_written);
  const std::string hand = glove_.hand ? glove_.hand->path : "";
  const std::string port = parts.has("port") ? parts.text("port") : board == "hand" ? hand : glove_.port();
  if (port.empty()) throw Refusal("no_board", {{"board", board}});
  // One folder for good, so that the pair keeps its key; the server does not show it.
  const std::string folder = (context_.sessions.root() / ".firmware").string();
  Json deploy = {{"model", worn_.model()->path.string()}, {"out", folder}};
  // A board that sends nothing yet gets the model's own.
  const double link_hz = worn_.stream.rate_hz();
  if (worn || options.rate_hz > 0 || link_hz > 0) deploy["rate"] = context_.model_rate_hz(link_hz);
  if (!options.key.empty()) deploy["key"] = options.key;
  const listen::Source* source = glove_.source();
  if (source && source->baud() > 0) deploy["baud"] = source->baud();
  const Json flash = {{"folder_or_hex", folder}, {"board", board}, {"port", port}};
  start("deploy", deploy, [this, flash](const JobResult& result) {
    const auto write = [&] { start_without_glove("flash", flash, [](const JobResult&) {}); };
    if (result.ok) context_.guard("flash", write);
  });
}

void JobRunner::run_score(const std::string& label) {
  const auto keep = [this, label](const JobResult& result) {
    if (!result.ok) return;
    double total_deg_s = 0;
    for (const Json& gesture_deg_s : result.json) total_deg_s += gesture_deg_s.get<double>();
    scores_.push_back({{"label", label}, {"total_deg_s", total_deg_s}, {"gestures_deg_s", result.json}});
  };
  run("score", "six gestures", context_.options.worn->score(), ending("score", keep));
}

void JobRunner::run_experiment(int trials) {
  const Session session = worn_.new_session("experiment");
  Json compensators = {"raw", "published-w", "published-hw"};
  if (worn_.model() && worn_.model()->joints.size() == twin::kFingers)
    compensators.push_back(worn_.model()->path.string());
  start("experiment",
        {{"trials", trials},
         {"compensators", std::move(compensators)},
         {"out", (context_.sessions.folder(session) / "experiment").string()}},
        [this](const JobResult& result) {
          if (result.ok) experiment_ = totals_of(result.json.at("cells"));
        });
}

void JobRunner::write(Json& state) const {
  state["scores"] = scores_;
  state["experiment"] = experiment_;
  if (!is_running()) return;
  state["job"] = io::to_json(progress());
  state["job"]["name"] = name();
}

}  // namespace flexor::live
