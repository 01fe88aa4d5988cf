// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// To which side a border between skin and what lies behind it steps at an end of a straight
// stretch; none where it ends.
enum BorderStep : int { to_skin = -1, no_step = 0, to_open = 1 };

// Between an outline and the border that it was sampled to, in one pixel beside the border: how
// much of the pixel behind skin covers, and how much of the skin's it does not.
struct OutlineAreas {
  double of_open = 0, of_skin = 0;
};

// Of a stretch's i-th pixel. The outline lies half a pixel off the border at an end, on the side
// that the border steps to, and is taken for straight from there to the stretch's middle.
OutlineAreas areas_of_slope(int length, BorderStep before, BorderStep after, int i);

// The same for a stretch both of whose ends step to one side: a parabola that rises from them, by
// `rise` pixels in the middle.
OutlineAreas areas_of_bow(int length, BorderStep ends, double rise, int i);

}  // namespace organbake
