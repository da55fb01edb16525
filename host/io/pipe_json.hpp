// Plain structs on their way through a pipe to a worker of the same version, and back with the same bits; no documents.
//
//   namespace x { FLEXOR_PIPE(Frame, sequence, angles) }     then Json(frame) and json.get<x::Frame>()
// nlohmann's own macro knows nlohmann::json alone. Throws nlohmann's exceptions where a member is missing.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

template <class T>
struct nlohmann::adl_serializer<std::optional<T>> {
  static void to_json(ordered_json& json, const std::optional<T>& value) {
    json = value ? ordered_json(*value) : ordered_json(nullptr);
  }
  static void from_json(const ordered_json& json, std::optional<T>& value) {
    value = json.is_null() ? std::nullopt : std::optional<T>(json.get<T>());
  }
};

#define FLEXOR_PIPE(T, ...)                                                                  \
  inline void to_json(nlohmann::ordered_json& nlohmann_json_j, const T& nlohmann_json_t) {   \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_TO, __VA_ARGS__))                 \
  }                                                                                          \
  inline void from_json(const nlohmann::ordered_json& nlohmann_json_j, T& nlohmann_json_t) { \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_FROM, __VA_ARGS__))               \
  }
