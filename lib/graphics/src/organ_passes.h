// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "finishing.h"
#include "organ_tables.h"
#include "organbake/warp/joint_drawing.h"
#include "organbake/warp/organ_source.h"
#include "skin_light.h"
#include "targets.h"

namespace organbake {

// A camera of a view, and its share there.
struct Layer {
  const SampleTable* samples = nullptr;
  float share = 0;
};

// An organ in one picture.
struct PlacedOrgan {
  const JointDrawing::Organ* organ;
  OrganSource source;
  OrganTables* tables;
  ViewWeights weights;
  std::array<Layer, Targets::kLayers> layers;
  int layer_count = 0;
  DrawnLight light = DrawnLight::baked;
  double texel_mm = 1;

  void measure_texels();  // as ActiveCameras::texel_mm()
};

// The passes that graphics_drawing.h names, over all organs of a picture.
class OrganPasses {
 public:
  explicit OrganPasses(ShaderDialect dialect);

  // Throws what Warper::draw() does, and GraphicsError.
  const Targets::Picture& draw(const std::vector<JointDrawing::Organ>& all, const View& view,
                               const DrawOptions& options);
  // Of the last picture.
  const std::vector<PlacedOrgan>& organs() const { return organs_; }
  bool shows(const std::vector<JointDrawing::Organ>& all) const;  // these organs, as they lie
  float reach_mm() const { return scale_.reach_mm; }              // depths are shares of it
  const Targets& targets() const { return targets_; }
  std::size_t table_bytes() const;

 private:
  PlacedOrgan take(const JointDrawing::Organ& organ, const View& view, const DrawOptions& options);
  OrganTables& tables_of(const OrganSource& source);
  void set_scale(const View& view);
  void begin(const DrawOptions& options);
  void set_view(const Program& program, const PlacedOrgan& organ, const View& view) const;
  void draw_organ(const PlacedOrgan& organ, const View& view, const DrawOptions& options,
                  double reference_mm);
  void place_patches(const PlacedOrgan& organ, const View& view);
  void splat_layers(const PlacedOrgan& organ, const View& view, bool skip_nearest);
  void draw_base(const PlacedOrgan& organ, const View& view);
  void resolve_layers(const PlacedOrgan& organ, const View& view, const DrawOptions& options,
                      double reference_mm);

  // Patches as place.vert captured them, and how splat.vert reads them.
  struct PlacedPatches {
    BufferName buffer;
    VertexArrayName array;
    int room = 0;

    void reserve(int patches);
  };

  ShaderDialect dialect_;
  Program place_, splat_, base_, resolve_;
  Finishing finishing_;
  VertexArrayName nothing_;  // for what is drawn by its vertices' numbers
  std::array<PlacedPatches, Targets::kLayers> placed_;
  Targets targets_;
  Stretches stretches_;
  SkinLightUniforms skin_light_;
  std::vector<OrganTables> tables_;
  std::vector<PlacedOrgan> organs_;
  PictureScale scale_;
};

}  // namespace organbake
