// SPDX-License-Identifier: Apache-2.0
// Pictures by graphics hardware against the processor's, of a small organ; a software driver will
// do.
#include "organbake/graphics/graphics_drawing.h"

#include <cstdio>

#include "gl.h"
#include "organ_passes.h"
#include "organbake/image/difference.h"
#include "organbake/image/png.h"
#include "organbake/warp/organ_source.h"
#include "organbake/warp/warper.h"
#include "small_organ.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using GraphicsDrawingTest = GraphicsTest;

Positions twisted(const TriangleMesh& proxy) {
  const Vector3d center = bounds(proxy).center();
  Positions turned = proxy.vertices;
  for (Vector3d& vertex : turned) {
    const double angle = 0.012 * (vertex.z() - center.z());
    vertex = center + Eigen::AngleAxisd(angle, Vector3d::UnitZ()) * (vertex - center);
  }
  return turned;
}

// Both ways of drawing organs, side by side.
class BothWays {
 public:
  struct Pair {
    Frame processor, graphics;
    ImageDifference difference;
    double similarity = 0;
    std::size_t apart = 0;  // pixels that one shows as background alone, no neighbour agreeing
  };

  Pair draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
            const DrawOptions& options) {
    Pair pair;
    joint_.draw(organs, view, options, pair.processor);
    graphics_.draw(organs, view, options, pair.graphics);
    pair.difference = compare_images(pair.processor.color, pair.graphics.color);
    pair.similarity = structural_similarity(pair.processor.color, pair.graphics.color);
    pair.apart = silhouettes_apart(pair.processor, pair.graphics) +
                 silhouettes_apart(pair.graphics, pair.processor);
    return pair;
  }

 private:
  // Covered pixels of one without any covered pixel of the other within a pixel.
  static std::size_t silhouettes_apart(const Frame& one, const Frame& other) {
    std::size_t apart = 0;
    for (int y = 1; y + 1 < one.color.height; ++y) {
      for (int x = 1; x + 1 < one.color.width; ++x) {
        if (!one.covered(x, y)) continue;
        bool near = false;
        for (int k = 0; k < 9; ++k) near = near || other.covered(x + k % 3 - 1, y + k / 3 - 1);
        apart += !near;
      }
    }
    return apart;
  }

  OffscreenContext context_;
  GraphicsDrawing graphics_;
  JointDrawing joint_;
};

// Keeps a pair and what is between them, ten times, where ORGANBAKE_PICTURES asks for pictures.
void keep_pictures(const BothWays::Pair& pair, const std::string& name) {
  const char* const folder = std::getenv("ORGANBAKE_PICTURES");
  if (!folder) return;
  Rgb8Image between(pair.processor.color.width, pair.processor.color.height);
  for (std::size_t i = 0; i < between.pixels.size(); ++i) {
    const int apart =
        std::abs(int(pair.processor.color.pixels[i]) - int(pair.graphics.color.pixels[i]));
    between.pixels[i] = static_cast<std::uint8_t>(std::min(255, 10 * apart));
  }
  const std::filesystem::path base = std::filesystem::path(folder) / name;
  write_png(base.string() + "_cpu.png", pair.processor.color);
  write_png(base.string() + "_gpu.png", pair.graphics.color);
  write_png(base.string() + "_apart_x10.png", between);
}

// What the pictures must agree in: about what 8 bits and half a pixel's light leave.
constexpr double kLeastPsnr_db = 40, kLeastSimilarity = 0.99;
// The tip of a tool that is thinner than a pixel may meet a pixel's middle in one of them alone.
constexpr std::size_t kMostTips_px = 2;

void expect_alike(const BothWays::Pair& pair, const std::string& name, std::size_t most_apart = 0) {
  keep_pictures(pair, name);
  std::printf("%-28s %6.2f dB, SSIM %.4f, largest %3.0f, silhouettes %zu px apart\n", name.c_str(),
              pair.difference.psnr_db, pair.similarity, pair.difference.max_abs, pair.apart);
  EXPECT_GE(pair.difference.psnr_db, kLeastPsnr_db) << name;
  EXPECT_GE(pair.similarity, kLeastSimilarity) << name;
  EXPECT_LE(pair.apart, most_apart) << name;
}

TEST_F(GraphicsDrawingTest, LooksAsTheProcessorsPicture) {
  const Bundle& bundle = tested_organ();
  Warper warper(bundle);
  BothWays both;
  const std::array<std::pair<const char*, Positions>, 3> poses = {
      {{"rest", bundle.proxy.vertices},
       {"poke", dented(bundle.proxy, {1, 0.4, 0.3}, 15)},
       {"twist", twisted(bundle.proxy)}}};
  // Of all texels' sizes, from a few in a pixel to many pixels a texel.
  const std::array<std::pair<const char*, View>, 3> views = {
      {{"far", view_at(bundle, {1, 0.5, 0.35}, 190)},
       {"aside", view_at(bundle, {-0.3, 1, 0.2}, 120)},
       {"near", view_at(bundle, {0.8, 0.6, 0.1}, 85)}}};
  // Each light in each pose, and so in each view.
  std::size_t drawn = 0;
  for (const auto& [pose, positions] : poses) {
    for (const DrawnLight light : {DrawnLight::baked, DrawnLight::world, DrawnLight::scope}) {
      const auto& [place, view] = views[(drawn + drawn / 3) % views.size()];
      DrawOptions options;
      options.light = light;
      expect_alike(both.draw({{warper, positions, bundle.proxy, bundle.lighting}}, view, options),
                   std::string(pose) + "_" + place + "_" + to_string(light));
      ++drawn;
    }
  }
}

Solid rod(const Vector3d& from, const Vector3d& to, double radius_mm) {
  Solid solid;
  solid.from = from, solid.to = to, solid.radius_mm = radius_mm;
  return solid;
}

// A rod into the organ, a ball before it and a plate half behind it.
std::vector<Solid> tools_at(const Vector3d& center) {
  std::vector<Solid> tools = {rod(center, center + Vector3d(70, 40, 60), 2.5),
                              rod(center + Vector3d(75, 10, 10), center + Vector3d(75, 10, 10), 6)};
  tools.push_back(rod(center + Vector3d(30, 60, 10), center + Vector3d(40, 40, 60), 1));
  tools.back().corner = center + Vector3d(55, 35, 20);
  return tools;
}

TEST_F(GraphicsDrawingTest, DrawsToolsOverTwoOrgans) {
  const Bundle& first = tested_organ();
  const Bundle second = small_organ({10, 40, 75}, 128);
  Warper of_first(first), of_second(second);
  const std::vector<JointDrawing::Organ> organs = {
      {of_first, first.proxy.vertices, first.proxy, first.lighting},
      {of_second, second.proxy.vertices, second.proxy, second.lighting}};
  BothWays both;
  DrawOptions options;
  options.light = DrawnLight::world;
  options.keep_depth = true;
  options.solids = tools_at(first.cameras.manifold.center_world_mm);
  const BothWays::Pair pair = both.draw(organs, view_at(first, {1, 0.3, 0.5}, 260), options);
  expect_alike(pair, "two_organs_and_tools", kMostTips_px);
  std::size_t tools = 0, far_apart = 0;
  for (std::size_t i = 0; i < pair.graphics.cover.size(); ++i) {
    tools += pair.graphics.cover[i] == Cover::solid;
    far_apart += std::abs(pair.graphics.depth_mm[i] - pair.processor.depth_mm[i]) > 1;
  }
  EXPECT_GT(tools, 500u);
  // Where one surface ends before another, single pixels go either way.
  EXPECT_LT(far_apart, pair.graphics.cover.size() / 1000);
}

TEST_F(GraphicsDrawingTest, ToolsShadeTheSkinByTheLightAtTheScope) {
  const Bundle& bundle = tested_organ();
  Warper warper(bundle);
  const std::vector<JointDrawing::Organ> organs = {
      {warper, bundle.proxy.vertices, bundle.proxy, bundle.lighting}};
  const View view = view_at(bundle, {1, 0.3, 0.5}, 150);
  BothWays both;
  DrawOptions options;
  options.light = DrawnLight::scope;
  const BothWays::Pair bare = both.draw(organs, view, options);
  options.solids = tools_at(bundle.cameras.manifold.center_world_mm);
  const BothWays::Pair pair = both.draw(organs, view, options);
  expect_alike(pair, "tools_by_the_scope", kMostTips_px);
  std::size_t darker = 0, apart = 0;
  for (std::size_t i = 0; i < pair.graphics.cover.size(); ++i) {
    if (pair.graphics.cover[i] != Cover::samples || pair.processor.cover[i] != Cover::samples)
      continue;
    const auto change = [i](const BothWays::Pair& with, const BothWays::Pair& without, auto way) {
      return int((with.*way).color.pixels[3 * i]) - int((without.*way).color.pixels[3 * i]);
    };
    const int by_graphics = change(pair, bare, &BothWays::Pair::graphics);
    darker += by_graphics < -10;
    apart += std::abs(by_graphics - change(pair, bare, &BothWays::Pair::processor)) > 10;
  }
  EXPECT_GT(darker, 300u);
  EXPECT_LT(apart, darker / 20) << "pixels whose shadow the processor has otherwise";
}

// Each eye has its own picture, though both are drawn from what was uploaded once.
TEST_F(GraphicsDrawingTest, TwoEyesLookAtOnePose) {
  const Bundle& bundle = tested_organ();
  Warper warper(bundle);
  const Positions positions = dented(bundle.proxy, {1, 0.4, 0.3}, 12);
  const std::vector<JointDrawing::Organ> organs = {
      {warper, positions, bundle.proxy, bundle.lighting}};
  DrawOptions options;
  options.light = DrawnLight::scope;
  options.solids = tools_at(bundle.cameras.manifold.center_world_mm);
  const View left = view_at(bundle, {1, 0.3, 0.5}, 120);
  View right = left;
  right.camera.camera_from_world.translation.x() -= 5;
  BothWays both;
  const std::array<BothWays::Pair, 2> eyes = {both.draw(organs, left, options),
                                              both.draw(organs, right, options)};
  expect_alike(eyes[0], "left_eye", kMostTips_px);
  expect_alike(eyes[1], "right_eye", kMostTips_px);
  EXPECT_LT(compare_images(eyes[0].graphics.color, eyes[1].graphics.color).psnr_db, 30);
}

TEST_F(GraphicsDrawingTest, OpenGlEsDrawsTheSame) {
  const Bundle& bundle = tested_organ();
  Warper warper(bundle);
  const std::vector<JointDrawing::Organ> organs = {
      {warper, bundle.proxy.vertices, bundle.proxy, bundle.lighting}};
  const View view = view_at(bundle, {1, 0.5, 0.35}, 130);
  DrawOptions options;
  options.light = DrawnLight::scope;
  std::array<Frame, 2> frames;
  for (const auto kind : {OffscreenContext::Kind::desktop, OffscreenContext::Kind::embedded}) {
    const OffscreenContext context(kind);
    GraphicsDrawing(GraphicsDrawing::FirstPicture::checked)
        .draw(organs, view, options, frames[static_cast<int>(kind)]);
  }
  EXPECT_GT(compare_images(frames[0].color, frames[1].color).psnr_db, 50);
}

TEST_F(GraphicsDrawingTest, LeavesAPictureThatStaysAlone) {
  const Bundle& bundle = tested_organ();
  Warper warper(bundle);
  const OffscreenContext context;
  GraphicsDrawing drawing;
  Positions positions = bundle.proxy.vertices;
  const std::vector<JointDrawing::Organ> organs = {
      {warper, positions, bundle.proxy, bundle.lighting}};
  const View view = view_at(bundle, {1, 0, 0}, 200);
  Frame frame;
  EXPECT_FALSE(drawing.draw(organs, view, {}, frame).unchanged);
  EXPECT_TRUE(drawing.draw(organs, view, {}, frame).unchanged);
  Frame aside;
  EXPECT_FALSE(drawing.draw(organs, view_at(bundle, {1, 0.1, 0}, 200), {}, aside).unchanged);
  EXPECT_TRUE(drawing.draw(organs, view, {}, frame).unchanged) << "as the other eye's";
  const Rgb8Image before = frame.color;
  positions = dented(bundle.proxy, {1, 0, 0}, 10);
  EXPECT_FALSE(drawing.draw(organs, view, {}, frame).unchanged);
  EXPECT_NE(before.pixels, frame.color.pixels);
  // The processor's own next picture of this frame is made from nothing, not gone on with.
  Frame anew;
  warper.draw(positions, view, {}, frame);
  Warper(bundle).draw(positions, view, {}, anew);
  EXPECT_EQ(frame.color.pixels, anew.color.pixels);
}

}  // namespace

// What graphics hardware keeps of an organ from picture to picture.
namespace {

using OrganTablesTest = GraphicsTest;

TEST_F(OrganTablesTest, KeepsTheSamplesOfTheLastViewsAlone) {
  const Bundle& bundle = tested_organ();
  const Positions& positions = bundle.proxy.vertices;
  Warper warper(bundle);
  const OffscreenContext context;
  const OrganSource source = warper.pose(positions, false);
  constexpr std::size_t kFew_bytes = 2'500'000;
  OrganTables all, few(kFew_bytes);
  for (std::size_t camera = 0; camera + 1 < bundle.cameras.cameras.size(); ++camera) {
    for (OrganTables* tables : {&all, &few}) {
      tables->pose(source, positions, false);
      const int patches = tables->samples(warper, camera).patches;
      EXPECT_EQ(tables->samples(warper, camera + 1).patches > 0, patches > 0);
    }
  }
  EXPECT_GT(all.bytes(), 2 * few.bytes());
  EXPECT_LE(few.bytes(), kFew_bytes);
  // What a picture asks for stays until its end, though it be more.
  few.pose(source, positions, false);
  for (std::size_t camera = 0; camera < bundle.cameras.cameras.size(); ++camera)
    few.samples(warper, camera);
  EXPECT_EQ(few.bytes(), all.bytes());
}

// Of an organ that is cut further, or whole again, pictures are those of whoever never saw it
// before.
TEST_F(OrganTablesTest, ACutThatGrowsIsDrawnAsOneThatWasThereBefore) {
  const Bundle& bundle = tested_organ();
  Warper whole(bundle);
  // Faces with a lip at one corner.
  const auto cut_at = [&](std::uint32_t from, std::uint32_t to) {
    CutOrgan::FaceParts parts;
    for (std::uint32_t face = from; face < to; ++face)
      parts[face] = {{face, {Eigen::Vector2d(0, 0), {1, 0}, {0, 1}}, {0, 3, 3}}};
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
