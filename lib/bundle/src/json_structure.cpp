// SPDX-License-Identifier: Apache-2.0
// A pass over a JSON text that builds nothing and finds what a parser would not refuse: nesting
// deep enough to exhaust the stack, and keys that an object has twice.
#include "organbake/bundle/json_structure.h"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// Whatever walks a document calls itself once a level: a million brackets would end the stack.
constexpr int kDeepest = 100;

// A pass of its own: a parser that asks about each value takes the square of an array's length.
class StructureChecker : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit StructureChecker(const std::string& name) : name_(name) {}

  bool start_object(std::size_t) override {
    keys_.emplace_back();
    return enter();
  }
  bool end_object() override {
    keys_.pop_back();
    return leave();
  }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool key(std::string& key) override {
    if (!keys_.back().insert(key).second)
      throw BadDataError(name_ + ": has the key '" + key + "' twice");
    return true;
  }
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(std::int64_t) override { return true; }
  bool number_unsigned(std::uint64_t) override { return true; }
  bool number_float(double, const std::string&) override { return true; }
  bool string(std::string&) override { return true; }
  bool binary(nlohmann::json::binary_t&) override { return true; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override {
    return false;  // reading says it better
  }

 private:
  bool enter() {
    if (++depth_ > kDeepest) throw BadDataError(name_ + ": is nested too deeply");
    return true;
  }
  bool leave() {
    --depth_;
    return true;
  }

  const std::string& name_;
  int depth_ = 0;
  std::vector<std::set<std::string>> keys_;  // of the objects that are open
};

}  // namespace

void check_json_structure(const std::string& text, const std::string& name) {
  StructureChecker checker(name);
  nlohmann::json::sax_parse(text, &checker);
}

}  // namespace organbake
