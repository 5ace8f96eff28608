// What a model shows, for programs that draw it by themselves. Only reads the model, and needs no
// function of MuJoCo.

#include <mujoco/mujoco.h>
#include <string.h>

enum { FS_PLANE, FS_SPHERE, FS_CAPSULE, FS_ELLIPSOID, FS_CYLINDER, FS_BOX, FS_MESH, FS_OTHER };

typedef struct {
  int shape, group, body, ntriangle;
  float rgba[4];
  double size[3], position[3], orientation[4];
} fs_visual_geom;

static int fs_shape(int type) {
  switch (type) {
    case mjGEOM_PLANE: return FS_PLANE;
    case mjGEOM_SPHERE: return FS_SPHERE;
    case mjGEOM_CAPSULE: return FS_CAPSULE;
    case mjGEOM_ELLIPSOID: return FS_ELLIPSOID;
    case mjGEOM_CYLINDER: return FS_CYLINDER;
    case mjGEOM_BOX: return FS_BOX;
    case mjGEOM_MESH: return FS_MESH;
    default: return FS_OTHER;
  }
}

// Describes the geom of an id below `ngeom`.
void fs_get_visual_geom(const mjModel* m, int geom, fs_visual_geom* out) {
  static const float unset[4] = {0.5f, 0.5f, 0.5f, 1.0f};
  out->shape = fs_shape(m->geom_type[geom]);
  out->group = m->geom_group[geom];
  out->body = m->geom_bodyid[geom];
  out->ntriangle = out->shape == FS_MESH ? m->mesh_facenum[m->geom_dataid[geom]] : 0;
  memcpy(out->size, m->geom_size + 3 * geom, sizeof out->size);
  memcpy(out->position, m->geom_pos + 3 * geom, sizeof out->position);
  memcpy(out->orientation, m->geom_quat + 4 * geom, sizeof out->orientation);
  // As MuJoCo's renderer does: a color of the geom's own comes before its material's.
  const float* rgba = m->geom_rgba + 4 * geom;
  const int material = m->geom_matid[geom];
  if (material >= 0 && memcmp(rgba, unset, sizeof unset) == 0) rgba = m->mat_rgba + 4 * material;
  memcpy(out->rgba, rgba, sizeof out->rgba);
}

// The corners of a triangle of a geom's mesh, in the geom's frame, for numbers below `ntriangle`.
void fs_get_triangle(const mjModel* m, int geom, int triangle, double corners[3][3]) {
  const int mesh = m->geom_dataid[geom];
  const int* vertices = m->mesh_face + 3 * (m->mesh_faceadr[mesh] + triangle);
  for (int i = 0; i < 3; i++) {
    const float* vertex = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + vertices[i]);
    for (int axis = 0; axis < 3; axis++) corners[i][axis] = vertex[axis];
  }
}
