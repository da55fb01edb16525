#include "host/export/lsl.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include "host/io/io.hpp"

namespace flexor::exports {

// What liblsl hands out.
struct InfoHandle;
struct OutletHandle;
struct NodeHandle;

namespace {

constexpr int kDouble = 2;  // lsl_channel_format_t
constexpr int kBuffered_s = 60;

constexpr const char* kMend =
    "`pip install pylsl` brings it; FLEXOR_LSL is the path that "
    "`python3 -c \"import pylsl.lib as l; print(l.__path__[0] + '/liblsl.so')\"` prints";

std::vector<std::string> places_of(const LslOptions& options) {
  if (!options.library.empty()) return {options.library.string()};
  if (const char* named = std::getenv("FLEXOR_LSL"); named != nullptr && *named != '\0') return {named};
  return {"liblsl.so", "liblsl.so.2"};
}

}  // namespace

struct LslStream::Library {
  void* handle = nullptr;
  InfoHandle* (*create_streaminfo)(const char*, const char*, std::int32_t, double, int, const char*);
  void (*destroy_streaminfo)(InfoHandle*);
  NodeHandle* (*get_desc)(InfoHandle*);
  NodeHandle* (*append_child)(NodeHandle*, const char*);
  NodeHandle* (*append_child_value)(NodeHandle*, const char*, const char*);
  OutletHandle* (*create_outlet)(InfoHandle*, std::int32_t, std::int32_t);
  void (*destroy_outlet)(OutletHandle*);
  std::int32_t (*push_sample_dt)(OutletHandle*, const double*, double);
  std::int32_t (*have_consumers)(OutletHandle*);
  double (*local_clock)();

  explicit Library(const LslOptions& options) {
    const std::vector<std::string> places = places_of(options);
    for (const std::string& place : places) {
      if (handle == nullptr) handle = ::dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    }
    if (handle == nullptr)
      throw io::InputError(fmt::format("{}: cannot be loaded ({}): {}", places.front(), ::dlerror(), kMend));
    find(create_streaminfo, "lsl_create_streaminfo");
    find(destroy_streaminfo, "lsl_destroy_streaminfo");
    find(get_desc, "lsl_get_desc");
    find(append_child, "lsl_append_child");
    find(append_child_value, "lsl_append_child_value");
    find(create_outlet, "lsl_create_outlet");
    find(destroy_outlet, "lsl_destroy_outlet");
    find(push_sample_dt, "lsl_push_sample_dt");
    find(have_consumers, "lsl_have_consumers");
    find(local_clock, "lsl_local_clock");
  }

  // It stays loaded: its threads may live on for a moment.
  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(::dlsym(handle, name));
    if (function == nullptr)
      throw io::InputError(fmt::format("the library that was loaded as liblsl has no {}: {}", name, kMend));
  }
};

struct LslStream::Outlet {
  const Library& lsl;
  std::string name;
  std::size_t joints;
  InfoHandle* info = nullptr;
  OutletHandle* outlet = nullptr;
  std::optional<double> offset_s;
  std::uint64_t samples = 0;

  Outlet(const Library& library, const std::vector<std::string>& labels, const LslOptions& o)
      : lsl(library), name(o.name), joints(labels.size()) {
    info = lsl.create_streaminfo(o.name.c_str(), o.type.c_str(), static_cast<std::int32_t>(joints), o.rate_hz,
                                 kDouble, o.source_id.c_str());
    if (info == nullptr) throw io::JobError("liblsl makes no stream with this name and these joints");
    describe(labels);
    outlet = lsl.create_outlet(info, 0, kBuffered_s);
    if (outlet != nullptr) return;
    lsl.destroy_streaminfo(info);
    throw io::JobError("liblsl makes no outlet: is the network switched off, loopback too?");
  }
  ~Outlet() {
    lsl.destroy_outlet(outlet);
    lsl.destroy_streaminfo(info);
  }
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  void describe(const std::vector<std::string>& labels) {
    NodeHandle* desc = lsl.get_desc(info);
    lsl.append_child_value(desc, "manufacturer", "Flexor " FLEXOR_VERSION);
    NodeHandle* channels = lsl.append_child(desc, "channels");
    for (const std::string& label : labels) {
      NodeHandle* channel = lsl.append_child(channels, "channel");
      lsl.append_child_value(channel, "label", label.c_str());
      lsl.append_child_value(channel, "unit", "degrees");
      lsl.append_child_value(channel, "type", "JointAngle");
    }
  }
};

LslStream::LslStream(const std::vector<std::string>& joints, const LslOptions& options)
    : library_(std::make_unique<Library>(options)),
      outlet_(std::make_unique<Outlet>(*library_, joints, options)) {}

void LslStream::require_library(const LslOptions& options) { (void)Library(options); }

LslStream::~LslStream() = default;

void LslStream::add(double t_s, std::span<const double> angle_deg) {
  assert(angle_deg.size() == outlet_->joints);
  if (!outlet_->offset_s) outlet_->offset_s = library_->local_clock() - t_s;
  library_->push_sample_dt(outlet_->outlet, angle_deg.data(), t_s + *outlet_->offset_s);
  ++outlet_->samples;
}

bool LslStream::is_heard() const { return library_->have_consumers(outlet_->outlet) != 0; }

std::string LslStream::says() const {
  return fmt::format("LSL stream {}: {} samples{}", outlet_->name, outlet_->samples,
                     is_heard() ? "" : ", nobody listens");
}

}  // namespace flexor::exports
