// SPDX-License-Identifier: Apache-2.0
#include "shader_texts.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace organbake {
namespace {

bool validated(const std::string& text, const std::string& stage, const std::string& name) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / (name + "." + stage);
  std::ofstream(file) << text;
  return std::system(("glslangValidator -S " + stage + " " + file.string()).c_str()) == 0;
}

TEST(ShaderTexts, AreValidInBothDialects) {
  if (std::system("glslangValidator --version >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "glslangValidator is missing (Debian: glslang-tools): no shader was checked";
  for (const ShaderDialect dialect : {ShaderDialect::desktop, ShaderDialect::embedded}) {
    const std::string which = dialect == ShaderDialect::desktop ? "_desktop" : "_embedded";
    for (const ProgramFiles& program : program_files()) {
      EXPECT_TRUE(validated(shader_text(dialect, program.vertex), "vert",
                            std::string(program.name) + which));
      EXPECT_TRUE(validated(shader_text(dialect, program.fragment), "frag",
                            std::string(program.name) + which));
    }
  }
}

}  // namespace
}  // namespace organbake
