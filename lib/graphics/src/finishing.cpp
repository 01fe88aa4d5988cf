// SPDX-License-Identifier: Apache-2.0
#include "finishing.h"

#include <algorithm>

#include "opengl.h"
#include "organbake/warp/solids.h"

namespace organbake {
namespace {

constexpr int kFillRounds = 4;

}  // namespace

Finishing::Finishing(ShaderDialect dialect)
    : open_(dialect, files_of("open")),
      slits_(dialect, files_of("slits")),
      holes_(dialect, files_of("holes")),
      across_(dialect, files_of("across")),
      fade_(dialect, files_of("fade")),
      shadows_(dialect, files_of("shadows")),
      solids_(dialect, files_of("solids")),
      edges_(dialect, files_of("edges")),
      outline_(dialect, files_of("outline")) {}

const Targets::Picture& Finishing::apply(const View& view, const DrawOptions& options,
                                         PictureScale scale, Targets& targets) {
  last_ = &targets.resolved;
  glDepthFunc(GL_ALWAYS);
  if (options.fill_holes) fill_holes(scale, targets);
  if (options.smooth_outline && scale.fade_px > 1)
    fade_borders(scale.fade_px, options.background, targets);
  if (!options.solids.empty()) draw_solids(view, options.solids, scale, targets);
  if (options.smooth_outline) smooth_outlines(scale, targets);
  return *last_;
}

void Finishing::set_common(const Program& program, const Targets::Picture& from, Targets& targets) {
  program.use();
  program.set("picture", Eigen::Vector2f(float(targets.width), float(targets.height)));
  program.set_texture("colors", GL_TEXTURE_2D, from.color.texture());
  program.set_texture("depths", GL_TEXTURE_2D, from.depth.texture());
}

void Finishing::pass(const Program& program, Targets& targets) {
  set_common(program, *last_, targets);
  const Targets::Picture& to = targets.finished[next_];
  next_ = 1 - next_;
  glBindFramebuffer(GL_FRAMEBUFFER, to.framebuffer.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  last_ = &to;
}

void Finishing::fill_holes(PictureScale scale, Targets& targets) {
  open_.use();
  open_.set("texel", scale.texel_mm / scale.reach_mm);
  pass(open_, targets);
  for (const Eigen::Vector2i& back : {Eigen::Vector2i(0, -1), Eigen::Vector2i(-1, 0)}) {
    slits_.use();
    slits_.set("back", back);
    pass(slits_, targets);
  }
  for (int round = 0; round < kFillRounds; ++round) pass(holes_, targets);
}

void Finishing::fade_borders(int width_px, const std::array<std::uint8_t, 3>& background,
                             Targets& targets) {
  set_common(across_, *last_, targets);
  across_.set("fade", width_px);
  glBindFramebuffer(GL_FRAMEBUFFER, targets.edge_picture.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  fade_.use();
  fade_.set_texture("across", GL_TEXTURE_2D, targets.edges.texture());
  fade_.set("fade", width_px);
  const auto& [red, green, blue] = background;
  fade_.set("background", Eigen::Vector3f(Eigen::Vector3f(red, green, blue) / 255));
  pass(fade_, targets);
}

void Finishing::set_solids(const View& view, const std::vector<Solid>& solids) {
  solid_numbers_.clear();
  for (const Solid& solid : solids) {
    const RigidTransform& pose = view.camera.camera_from_world;
    const auto add = [this](const Eigen::Vector3d& place, float more) {
      const Eigen::Vector3f at = place.cast<float>();
      solid_numbers_.insert(solid_numbers_.end(), {at.x(), at.y(), at.z(), more});
    };
    add(pose * solid.from, static_cast<float>(solid.radius_mm));
    add(pose * solid.to, solid.corner ? 1.0f : 0.0f);
    add(solid.corner ? Eigen::Vector3d(pose * *solid.corner) : Eigen::Vector3d::Zero(), 0);
    add(solid.color.cast<double>(), 0);
  }
  solid_table_.fill(solid_numbers_);
}

void Finishing::pass_solids(const Program& program, const View& view,
                            const std::vector<Solid>& wide, PictureScale scale, Targets& targets) {
  const std::vector<SolidBlock> blocks = solid_blocks(wide, view);
  if (blocks.empty()) return;
  PixelBox box;
  for (const SolidBlock& block : blocks) box = united(box, block.box);
  program.set_texture("solids", GL_TEXTURE_2D, solid_table_.texture());
  program.set("solid_count", static_cast<int>(wide.size()));
  program.set("solid_box",
              Eigen::Vector4f(float(box.x0), float(box.y0), float(box.x1), float(box.y1)));
  program.set("view_lens", lens_of(view.camera.intrinsics));
  program.set("reach", scale.reach_mm);
  pass(program, targets);
}

void Finishing::draw_solids(const View& view, const std::vector<Solid>& solids, PictureScale scale,
                            Targets& targets) {
  set_solids(view, solids);
  if (scale.scope_light_mm) {
    shadows_.use();
    shadows_.set("light_mm", *scale.scope_light_mm);
    pass_solids(shadows_, view, with_shadows(solids), scale, targets);
  }
  solids_.use();
  solids_.set("near_mm", static_cast<float>(view.near_mm));
  pass_solids(solids_, view, solids, scale, targets);
}

void Finishing::smooth_outlines(PictureScale scale, Targets& targets) {
  set_common(edges_, *last_, targets);
  edges_.set("texel", scale.texel_mm / scale.reach_mm);
  edges_.set_texture("skin_depths", GL_TEXTURE_2D, targets.resolved.depth.texture());
  glBindFramebuffer(GL_FRAMEBUFFER, targets.edge_picture.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  outline_.use();
  outline_.set_texture("edges", GL_TEXTURE_2D, targets.edges.texture());
  pass(outline_, targets);
}

}  // namespace organbake
