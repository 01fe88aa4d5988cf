// SPDX-License-Identifier: Apache-2.0
// What graphics hardware keeps of an organ from picture to picture.
#include "organ_passes.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "gl.h"
#include "organbake/graphics/graphics_drawing.h"
#include "organbake/graphics/offscreen_drawing.h"
#include "organbake/warp/organ_source.h"
#include "organbake/warp/warper.h"
#include "small_organ.h"

namespace organbake {
namespace {

using OrganTablesTest = GraphicsTest;

TEST_F(OrganTablesTest, KeepsTheSamplesOfTheLastViewsAlone) {
  const Bundle& bundle = tested_organ();
  const Positions& positions = bundle.proxy.vertices;
  Warper warper(bundle);
  const OffscreenContext context;
  const OrganSource source = warper.pose(positions, false);
  constexpr std::size_t kFew_bytes = 3'000'000;
  OrganTables all(source), few(source, kFew_bytes);
  const std::size_t without = few.bytes();
  for (std::size_t camera = 0; camera + 1 < bundle.cameras.cameras.size(); ++camera) {
    for (OrganTables* tables : {&all, &few}) {
      tables->pose(source, positions, false);
      const int patches = tables->samples(warper, camera).patches;
      EXPECT_EQ(tables->samples(warper, camera + 1).patches > 0, patches > 0);
    }
  }
  EXPECT_GT(all.bytes(), 2 * few.bytes());
  EXPECT_LT(few.bytes(), without + kFew_bytes + 200'000) << "with the pose";
  // What a picture asks for stays until its end, though it be more.
  few.pose(source, positions, false);
  for (std::size_t camera = 0; camera < bundle.cameras.cameras.size(); ++camera)
    few.samples(warper, camera);
  EXPECT_EQ(few.bytes(), all.bytes());
}

// Of an organ that is cut further, or whole again, only what changes is uploaded: pictures are
// those of whoever never saw it before.
TEST_F(OrganTablesTest, ACutThatGrowsIsDrawnAsOneThatWasThereBefore) {
  const Bundle& bundle = tested_organ();
  Warper whole(bundle);
  // Faces whose edges are lips, which are wet.
  const auto cut_at = [&](std::uint32_t from, std::uint32_t to) {
    CutOrgan::FaceParts parts;
    for (std::uint32_t face = from; face < to; ++face)
      parts[face] = {{face, {Eigen::Vector2d(0, 0), {1, 0}, {0, 1}}, {true, true, true}}};
    return whole.cut(bundle, parts);
  };
  Warper cut = cut_at(0, 120), elsewhere = cut_at(100, 200);
  View view = view_at(bundle, {1, 0.3, 0.5}, 130);
  view.camera.intrinsics = {320, 180, 210, 210, 160, 90};
  const OffscreenContext context;
  GraphicsDrawing drawing;
  Rgb8Image last;
  for (Warper* warper : {&whole, &cut, &elsewhere, &whole}) {
    const std::vector<JointDrawing::Organ> organs = {
        {*warper, bundle.proxy.vertices, bundle.proxy, bundle.lighting}};
    DrawOptions options;
    options.light = DrawnLight::scope;
    Frame frame, anew;
    drawing.draw(organs, view, options, frame);
    GraphicsDrawing().draw(organs, view, options, anew);
    EXPECT_EQ(frame.color.pixels, anew.color.pixels);
    EXPECT_NE(frame.color.pixels, last.pixels);
    last = frame.color;
  }
}

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
