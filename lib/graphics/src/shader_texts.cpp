// SPDX-License-Identifier: Apache-2.0
#include "shader_texts.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>

#include "organbake/warp/frame.h"
#include "organbake/warp/organ_source.h"
#include "table.h"

namespace organbake {
namespace {

constexpr const char* kDesktop = "#version 330 core\n";
constexpr const char* kEmbedded =
    "#version 300 es\n"
    "precision highp float;\n"
    "precision highp int;\n";

std::string line(const std::string& name, const std::string& value) {
  return "#define " + name + " " + value + "\n";
}

std::string number(double value) {
  std::array<char, 40> text;
  std::snprintf(text.data(), text.size(), "%.9e", value);
  return text.data();
}

std::string constants() {
  std::string text;
  for (const ShaderConstant& constant : shader_constants()) {
    const std::string_view name = constant.name;
    const bool whole = name == "kGrainSide" || name == "kNormalReach";
    text +=
        line(constant.name, whole ? std::to_string(int(constant.value)) : number(constant.value));
  }
  text += line("kSlots", std::to_string(SampleSource::kSlots));
  text += line("kTableBits", std::to_string(Table::kBits));
  text += line("kTableColumns", std::to_string(Table::kColumns));
  text += line("kColorRoot", number(kColorRoot));
  text += line("kCoverSamples", number(double(Cover::samples)));
  text += line("kCoverBase", number(double(Cover::base)));
  text += line("kCoverFilled", number(double(Cover::filled)));
  text += line("kCoverSolid", number(double(Cover::solid)));
  return text;
}

#ifdef __EMSCRIPTEN__
// A page holds the texts, and puts them in the names' places.
std::string text_of(const std::string& name) { return "@" + name + "\n"; }
#else
std::string text_of(const std::string& name) {
  for (const ShaderFile& file : shader_files())
    if (file.name == name) return file.text;
  throw std::out_of_range("there is no shader " + name);
}
#endif

}  // namespace

std::vector<std::string> words_in(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    words.emplace_back(text.substr(0, text.find(' ')));
    text.remove_prefix(std::min(text.size(), words.back().size() + 1));
  }
  return words;
}

std::string shader_text(ShaderDialect dialect, std::string_view files) {
  static const std::string of_all = constants();
  std::string text = (dialect == ShaderDialect::desktop ? kDesktop : kEmbedded) + of_all;
  for (const std::string& name : words_in(files)) text += text_of(name);
  return text;
}

std::span<const ProgramFiles> program_files() {
  static constexpr std::array<ProgramFiles, 13> kFiles = {{
      {"place", "tables.glsl shell.glsl place.vert", "place.frag",
       "matrix0 matrix1 matrix2 matrix3 matrix4 matrix5 matrix6 texel_per_pixel splat"},
      {"splat", "tables.glsl splat.vert", "splat.frag"},
      {"base", "tables.glsl shell.glsl weight.glsl base.vert", "base.frag"},
      {"resolve", "screen.vert", "tables.glsl weight.glsl skin.glsl light.glsl resolve.frag"},
      {"open", "screen.vert", "finish.glsl pass.glsl open.frag"},
      {"slits", "screen.vert", "finish.glsl pass.glsl slits.frag"},
      {"holes", "screen.vert", "finish.glsl pass.glsl holes.frag"},
      {"across", "screen.vert", "finish.glsl across.frag"},
      {"fade", "screen.vert", "finish.glsl pass.glsl fade.frag"},
      {"shadows", "screen.vert", "tables.glsl finish.glsl pass.glsl shadows.frag"},
      {"solids", "screen.vert", "tables.glsl finish.glsl pass.glsl solids.frag"},
      {"edges", "screen.vert", "finish.glsl edges.frag"},
      {"outline", "screen.vert", "finish.glsl pass.glsl outline.frag"},
  }};
  return kFiles;
}

const ProgramFiles& files_of(std::string_view program) {
  const auto all = program_files();
  return *std::find_if(all.begin(), all.end(),
                       [&](const auto& one) { return one.name == program; });
}

}  // namespace organbake
