// SPDX-License-Identifier: Apache-2.0
#include "first_picture.h"

#include "organbake/core/text.h"
#include "organbake/graphics/graphics_drawing.h"
#include "organbake/image/difference.h"

namespace organbake {

void check_agreement(const std::vector<JointDrawing::Organ>& organs, const View& view,
                     const DrawOptions& options, const Frame& frame) {
  constexpr double kLeast_db = GraphicsDrawing::kLeastAgreement_db;
  Frame reference;
  JointDrawing().draw(organs, view, options, reference);
  const double psnr_db = compare_images(reference.color, frame.color).psnr_db;
  if (psnr_db < kLeast_db)
    throw GraphicsError("the graphics hardware's picture is not the processor's: they agree to " +
                        to_text(psnr_db, 1) + " dB, less than " + to_text(kLeast_db, 0));
}

}  // namespace organbake
