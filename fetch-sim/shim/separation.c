// The algorithm of Gilbert, Johnson and Keerthi (1988), on the shapes' cores: a simplex in their
// Minkowski difference approaches the point nearest to the origin. The result is always the gap of
// some direction, so a badly conditioned simplex costs time but not safety.

#include <math.h>
#include <string.h>

#include "shapes.h"

enum { MAX_ITERATIONS = 24 };

static void sub(double r[3], const double a[3], const double b[3]) {
  for (int i = 0; i < 3; i++) r[i] = a[i] - b[i];
}

static void cross(double r[3], const double a[3], const double b[3]) {
  r[0] = a[1] * b[2] - a[2] * b[1];
  r[1] = a[2] * b[0] - a[0] * b[2];
  r[2] = a[0] * b[1] - a[1] * b[0];
}

static void world_support(const fs_placed* placed, const double direction[3], double point[3]) {
  const double* r = placed->rotation;
  double local[3], found[3];
  for (int i = 0; i < 3; i++) {
    local[i] = r[i] * direction[0] + r[3 + i] * direction[1] + r[6 + i] * direction[2];
  }
  fs_support(placed->shape, local, found);
  for (int i = 0; i < 3; i++) point[i] = placed->position[i] + fs_dot(r + 3 * i, found);
}

// Writes the point of the Minkowski difference that is nearest along a direction.
static void nearest_along(const fs_placed* first, const fs_placed* second,
                          const double direction[3], double point[3]) {
  const double opposite[3] = {-direction[0], -direction[1], -direction[2]};
  double of_second[3];
  world_support(first, opposite, point);
  world_support(second, direction, of_second);
  sub(point, point, of_second);
}

double fs_gap(const fs_placed* first, const fs_placed* second, const double direction[3]) {
  double point[3];
  nearest_along(first, second, direction, point);
  return fs_dot(point, direction) - first->shape->round - second->shape->round;
}

// ---------------------------------------------------------------------------------- the simplex

typedef struct {
  int count;
  double points[4][3];
} simplex;

static void keep(simplex* s, int count, int a, int b, int c) {
  const int kept[3] = {a, b, c};
  double points[3][3];
  for (int i = 0; i < count; i++) memcpy(points[i], s->points[kept[i]], sizeof points[i]);
  memcpy(s->points, points, sizeof points);
  s->count = count;
}

static void nearest_on_segment(const double a[3], const double b[3], double nearest[3],
                               int* ends /* bits: a, b */) {
  double ab[3];
  sub(ab, b, a);
  const double along = -fs_dot(a, ab), length = fs_dot(ab, ab);
  const double t = along <= 0 ? 0 : along >= length ? 1 : along / length;
  *ends = t == 0 ? 1 : t == 1 ? 2 : 3;
  for (int i = 0; i < 3; i++) nearest[i] = a[i] + t * ab[i];
}

// Writes the point of a triangle nearest to the origin, and which corners span it (bits).
static void nearest_on_triangle(const double a[3], const double b[3], const double c[3],
                                double nearest[3], int* corners) {
  double ab[3], ac[3], normal[3], edge[3];
  sub(ab, b, a);
  sub(ac, c, a);
  cross(normal, ab, ac);
  const double* points[3] = {a, b, c};
  double best = HUGE_VAL;
  int inside = 1;
  for (int i = 0; i < 3; i++) {
    const double *p = points[i], *q = points[(i + 1) % 3];
    double pq[3];
    sub(pq, q, p);
    cross(edge, pq, normal);  // points out of the triangle
    if (fs_dot(edge, p) >= 0) continue;  // the origin is on the inner side of this edge
    inside = 0;
    double candidate[3];
    int ends;
    nearest_on_segment(p, q, candidate, &ends);
    const double distance = fs_dot(candidate, candidate);
    if (distance < best) {
      best = distance;
      memcpy(nearest, candidate, sizeof candidate);
      *corners = (ends & 1 ? 1 << i : 0) | (ends & 2 ? 1 << (i + 1) % 3 : 0);
    }
  }
  if (inside) {
    const double scale = fs_dot(normal, a) / fs_dot(normal, normal);
    for (int i = 0; i < 3; i++) nearest[i] = normal[i] * scale;
    *corners = 7;
  }
}

static void keep_corners(simplex* s, const int face[3], int corners) {
  int kept[3] = {0}, count = 0;
  for (int i = 0; i < 3; i++) {
    if (corners >> i & 1) kept[count++] = face[i];
  }
  keep(s, count, kept[0], kept[1], kept[2]);
}

// Writes the point of a simplex nearest to the origin, and drops the corners that do not span it.
// Returns 0 if the origin is inside.
static int nearest_on_simplex(simplex* s, double nearest[3]) {
  static const int faces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  int corners;
  switch (s->count) {
    case 1:
      memcpy(nearest, s->points[0], sizeof s->points[0]);
      return 1;
    case 2:
      nearest_on_segment(s->points[0], s->points[1], nearest, &corners);
      if (corners != 3) keep(s, 1, corners == 2, 0, 0);
      return 1;
    case 3:
      nearest_on_triangle(s->points[0], s->points[1], s->points[2], nearest, &corners);
      keep_corners(s, faces[0], corners);
      return 1;
    default: {
      double best = HUGE_VAL;
      int best_face = -1, best_corners = 0;
      for (int f = 0; f < 4; f++) {
        const double *a = s->points[faces[f][0]], *b = s->points[faces[f][1]];
        const double *c = s->points[faces[f][2]], *opposite = s->points[faces[f][3]];
        double ab[3], ac[3], ao[3], normal[3], candidate[3];
        sub(ab, b, a);
        sub(ac, c, a);
        sub(ao, opposite, a);
        cross(normal, ab, ac);
        if (fs_dot(normal, a) * fs_dot(normal, ao) <= 0) continue;  // the origin is on the inner side
        nearest_on_triangle(a, b, c, candidate, &corners);
        const double distance = fs_dot(candidate, candidate);
        if (distance < best) {
          best = distance;
          best_face = f;
          best_corners = corners;
          memcpy(nearest, candidate, sizeof candidate);
        }
      }
      if (best_face < 0) return 0;
      keep_corners(s, faces[best_face], best_corners);
      return 1;
    }
  }
}

double fs_separate(const fs_placed* first, const fs_placed* second, double least,
                   double direction[3]) {
  const double round = first->shape->round + second->shape->round;
  simplex s = {0};
  double best = -HUGE_VAL, tried[3];
  memcpy(tried, direction, sizeof tried);
  for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
    double nearest[3];
    nearest_along(first, second, tried, s.points[s.count]);
    const double gap = fs_dot(s.points[s.count], tried) - round;
    s.count++;
    if (gap > best) {
      best = gap;
      memcpy(direction, tried, sizeof tried);
    }
    if (!nearest_on_simplex(&s, nearest)) break;
    const double distance = sqrt(fs_dot(nearest, nearest));
    const double most = distance - round;  // an upper bound of the distance
    if (!(most > least) || (best > least && best > most / 2)) break;
    if (most - best < 1e-7) break;  // close enough
    for (int i = 0; i < 3; i++) tried[i] = nearest[i] / distance;
  }
  return best;
}
