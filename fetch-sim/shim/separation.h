// How far apart two convex shapes are at least.

#ifndef FETCH_SHIM_SEPARATION_H_
#define FETCH_SHIM_SEPARATION_H_

#include "shapes.h"

typedef struct {
  const fs_shape* shape;
  const double* position;  // of the geom's frame in the world
  const double* rotation;  // row by row
} fs_placed;

// The gap between two shapes along a direction of unit length that points from the second to the
// first: between the planes across that direction that touch them. Their distance is not less,
// whatever the direction; rounding and the error of the supports apart (see contact_filter.c).
double fs_gap(const fs_placed* first, const fs_placed* second, const double direction[3]);

// Looks for a direction with a gap greater than `least`, from `direction` on, and returns the
// greatest gap found, with its direction. Stops at a gap that is greater than `least` and half of
// what any direction can give; gives up when none can be greater than `least`.
double fs_separate(const fs_placed* first, const fs_placed* second, double least,
                   double direction[3]);

#endif
