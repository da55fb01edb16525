// The JSON Schema is that of docs, accepts every model and refuses what the reader refuses.
#include <gtest/gtest.h>

#include <filesystem>

#include "host/io/io.hpp"
#include "host/model/hardware.hpp"
#include "host/model/random_model.hpp"

namespace flexor::model {
namespace schema_test {

const Json& whole_schema() {
  static const Json kSchema = Json::parse(schema_json());
  return kSchema;
}

bool has_type(const Json& value, const std::string& type) {
  if (type == "integer") return value.is_number() && value.get<double>() == std::floor(value.get<double>());
  return type == "number" ? value.is_number() : type == value.type_name();
}

// Of the keywords that the schema uses. Any other is a failure of the test.
bool is_valid(const Json& value, const Json& schema);

bool keeps(const Json& value, const std::string& keyword, const Json& rule, const Json& schema) {
  const auto all = [&](const auto& list, const auto& one) {
    return std::all_of(list.begin(), list.end(), one);
  };
  const auto count = [&](const Json& list) {
    return std::count_if(list.begin(), list.end(), [&](const Json& one) { return is_valid(value, one); });
  };
  if (keyword == "type") return has_type(value, rule);
  if (keyword == "const") return value == rule;
  if (keyword == "enum") return std::ranges::find(rule, value) != rule.end();
  if (keyword == "oneOf") return count(rule) == 1;
  if (keyword == "anyOf") return count(rule) >= 1;
  if (keyword == "minimum") return value >= rule;
  if (keyword == "maximum") return value <= rule;
  if (keyword == "minItems") return value.size() >= rule;
  if (keyword == "maxItems") return value.size() <= rule;
  if (keyword == "minLength") return value.get<std::string>().size() >= rule;
  if (keyword == "maxLength") return value.get<std::string>().size() <= rule;
  if (keyword == "items") return all(value, [&](const Json& one) { return is_valid(one, rule); });
  if (keyword == "required")
    return all(rule, [&](const Json& key) { return value.contains(key.get<std::string>()); });
  if (keyword == "properties")
    return all(value.items(), [&](const auto& item) {
      return !rule.contains(item.key()) || is_valid(item.value(), rule[item.key()]);
    });
  if (keyword == "additionalProperties")
    return all(value.items(), [&](const auto& item) { return schema["properties"].contains(item.key()); });
  EXPECT_TRUE(keyword == "$schema" || keyword == "title" || keyword == "default") << keyword;
  return true;
}

bool is_valid(const Json& value, const Json& schema) {
  if (schema.contains("type") && !has_type(value, schema["type"])) return false;
  const auto& rules = schema.items();
  return std::all_of(rules.begin(), rules.end(),
                     [&](const auto& rule) { return keeps(value, rule.key(), rule.value(), schema); });
}

bool is_read(const Json& document) {
  try {
    (void)from_json(document.dump(), "m.json");
    return true;
  } catch (const io::InputError&) {
    return false;
  }
}

// With each member in turn left out, and of another type; and with one that is unknown.
template <class Each>
void for_each_fault(Json& document, Json& object, Each each) {
  const Json whole = object;
  for (const auto& item : whole.items()) {
    object.erase(item.key());
    each(document);
    object = whole;
    object[item.key()] = item.value().is_number() ? Json("x") : Json(7);
    each(document);
    object = whole;
  }
  object["unknown"] = 1;
  each(document);
  object = whole;
}

TEST(Schema, IsThatOfTheDocs) {
  EXPECT_EQ(io::read_document(FLEXOR_SOURCE_DIR "/docs/model.schema.json"), schema_json())
      << "flexor show --schema > docs/model.schema.json";
}

TEST(Schema, OfHardwareIsThatOfTheDocsAndAcceptsThePresets) {
  EXPECT_EQ(io::read_document(FLEXOR_SOURCE_DIR "/docs/hardware.schema.json"), io::dump(hardware_schema()))
      << "flexor show --hardware flexor --schema > docs/hardware.schema.json";
  for (const char* name : {"flexor", "lucidgloves"}) {
    Json document = to_json(preset(name));
    EXPECT_TRUE(is_valid(document, hardware_schema())) << name;
    document["parameters"]["motor.supply_V"]["unit"] = "mV";
    EXPECT_FALSE(is_valid(document, hardware_schema()));
  }
}

TEST(Schema, AcceptsEveryModelThatIsShipped) {
  int models = 0;
  for (const char* folder : {"/models", "/examples"}) {
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(FLEXOR_SOURCE_DIR + std::string(folder))) {
      if (entry.path().extension() != ".json") continue;
      Json document = Json::parse(io::read_document(entry.path()));
      if (document["schema"] != "flexor-model") continue;
      EXPECT_TRUE(is_valid(document, whole_schema())) << entry.path();
      ++models;
    }
  }
  EXPECT_GE(models, 2);
}

TEST(Schema, AcceptsWhateverTheReaderAccepts) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Json document = Json::parse(to_json(RandomModel(seed).make()));
    ASSERT_TRUE(is_valid(document, whole_schema())) << document.dump();
    int refused = 0;
    const auto compare = [&](const Json& faulty) {
      const bool valid = is_valid(faulty, whole_schema());
      refused += valid ? 0 : 1;
      EXPECT_TRUE(valid || !is_read(faulty)) << faulty.dump();
    };
    for_each_fault(document, document, compare);
    for (const char* list : {"inputs", "blocks", "joints"})
      for_each_fault(document, document[list][0], compare);
    EXPECT_GE(refused, 30);
  }
}

}  // namespace schema_test
}  // namespace flexor::model
