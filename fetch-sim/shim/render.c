// Drawing a simulation off screen with MuJoCo's renderer.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "internal.h"

// --------------------------------------------------------------------------------- model and data

void fs_prepare_model(mjModel* m, int width, int height, int samples) {
  m->vis.global.offwidth = width;
  m->vis.global.offheight = height;
  m->vis.quality.offsamples = samples;
  m->vis.quality.shadowsize = 0;  // the scenes' light casts no shadow: saves 64 MB
}

fs_status fs_place(const mjModel* m, mjData* d) {
  FS_GUARDED(NULL, {
    mj->mj_kinematics(m, d);
    mj->mj_comPos(m, d);
    mj->mj_camlight(m, d);
  });
}

// -------------------------------------------------------------------------------------- renderers

struct fs_renderer {
  fs_gl* gl;
  mjrContext context;
  mjvScene scene;
  mjvOption option;
  mjvCamera camera;
  mjvPerturb perturb;
  mjrRect viewport;
};

enum { SPARE_GEOMS = 1000 };  // room in the scene for more than the model's geoms, such as sites

static fs_status make(const mjModel* m, fs_renderer* r) {
  FS_GUARDED(NULL, {
    mj->mjv_defaultScene(&r->scene);
    mj->mjv_defaultOption(&r->option);
    mj->mjv_defaultCamera(&r->camera);
    mj->mjv_defaultPerturb(&r->perturb);
    mj->mjr_defaultContext(&r->context);
    mj->mjv_makeScene(m, &r->scene, SPARE_GEOMS + (int)m->ngeom);
    mj->mjr_makeContext(m, &r->context, mjFONTSCALE_50);
    mj->mjr_setBuffer(mjFB_OFFSCREEN, &r->context);
  });
}

static void free_context(fs_renderer* r) { FS_RELEASE(mj->mjr_freeContext(&r->context)); }

static void free_scene(fs_renderer* r) { FS_RELEASE(mj->mjv_freeScene(&r->scene)); }

void fs_delete_renderer(fs_renderer* r) {
  fs_gl_outer outer;
  // Deleting the OpenGL context frees what is left of it.
  if (fs_gl_enter(r->gl, &outer) == FS_OK) {
    free_context(r);
    fs_gl_leave(&outer);
  }
  free_scene(r);
  fs_gl_delete(r->gl);
  free(r);
}

fs_status fs_make_renderer(const mjModel* m, fs_renderer** renderer, int* has_gl) {
  *renderer = NULL;
  fs_gl_outer outer;
  fs_gl* gl = fs_gl_make(&outer);
  *has_gl = gl != NULL;
  if (!gl) return FS_FAILED;
  fs_renderer* r = calloc(1, sizeof *r);
  if (!r) {
    fs_gl_leave(&outer);
    fs_gl_delete(gl);
    return fs_fail("no memory for a renderer");
  }
  r->gl = gl;
  r->viewport = (mjrRect){0, 0, m->vis.global.offwidth, m->vis.global.offheight};
  fs_status status = make(m, r);
  const mjrContext* made = &r->context;
  if (status == FS_OK && (made->offWidth != r->viewport.width || made->offHeight != r->viewport.height)) {
    status = fs_fail("OpenGL gave a framebuffer of %d x %d pixels", made->offWidth, made->offHeight);
  }
  fs_gl_leave(&outer);
  if (status & FS_FAILED) {
    free_scene(r);  // deleting the OpenGL context frees the rest
    fs_gl_delete(gl);
    free(r);
    return status;
  }
  *renderer = r;
  return status;
}

// ---------------------------------------------------------------------------------------- cameras

void fs_set_free_camera(fs_renderer* r, const double numbers[6]) {
  r->camera.type = mjCAMERA_FREE;
  r->camera.fixedcamid = -1;
  for (int i = 0; i < 3; i++) r->camera.lookat[i] = numbers[i];
  r->camera.distance = numbers[3];
  r->camera.azimuth = numbers[4];
  r->camera.elevation = numbers[5];
}

void fs_set_fixed_camera(fs_renderer* r, int id) {
  r->camera.type = mjCAMERA_FIXED;
  r->camera.fixedcamid = id;
}

// ------------------------------------------------------------------------------------------ looks

static int segment_kind(const mjvGeom* geom) {
  return geom->objtype == mjOBJ_GEOM   ? FS_SEGMENT_GEOM
         : geom->objtype == mjOBJ_SITE ? FS_SEGMENT_SITE
                                       : FS_SEGMENT_OTHER;
}

static void change_objects(mjvScene* scene, const fs_looks* looks) {
  int count = 0;
  for (int i = 0; i < scene->ngeom; i++) {
    mjvGeom geom = scene->geoms[i];
    float scale = 1;
    for (const fs_look* look = looks->objects; look < looks->objects + looks->count; look++) {
      if (look->kind != segment_kind(&geom) || look->id != geom.objid) continue;
      scale *= look->scale;
      for (int axis = 0; axis < 3; axis++) {
        geom.size[axis] *= look->scale;
        if (!isnan(look->color[axis])) geom.rgba[axis] = look->color[axis];
      }
    }
    if (scale > 0) scene->geoms[count++] = geom;
  }
  scene->ngeom = count;
}

static void change_light(mjvLight* light, const double numbers[3]) {
  float* dir = light->dir;
  // Adding 0 makes the azimuth of a vertical light 0, and not that of a negative 0.
  const double azimuth = isnan(numbers[0]) ? atan2(0.0 - dir[1], 0.0 - dir[0]) : numbers[0];
  const double elevation = isnan(numbers[1]) ? asin(fmin(fmax(-dir[2], -1), 1)) : numbers[1];
  if (!isnan(numbers[0]) || !isnan(numbers[1])) {
    dir[0] = (float)(-cos(elevation) * cos(azimuth));
    dir[1] = (float)(-cos(elevation) * sin(azimuth));
    dir[2] = (float)-sin(elevation);
  }
  for (int i = 0; i < 3; i++) {
    if (!isnan(numbers[2])) light->diffuse[i] = (float)numbers[2];
  }
}

// Turns the first vector by an angle toward the second, and the second with it.
static void turn(double first[3], double second[3], double angle) {
  const double c = cos(angle), s = sin(angle);
  for (int i = 0; i < 3; i++) {
    const double a = first[i], b = second[i];
    first[i] = c * a + s * b;
    second[i] = c * b - s * a;
  }
}

static void change_camera(mjvGLCamera* camera, const fs_looks* looks) {
  const float *f = camera->forward, *u = camera->up;
  double forward[3] = {f[0], f[1], f[2]}, up[3] = {u[0], u[1], u[2]};
  double left[3];
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    left[i] = up[j] * forward[k] - up[k] * forward[j];
    const double* moved = looks->moved;
    camera->pos[i] += (float)(-moved[0] * left[i] + moved[1] * up[i] + moved[2] * forward[i]);
  }
  turn(forward, left, looks->turned[0]);
  turn(forward, up, looks->turned[1]);
  for (int i = 0; i < 3; i++) {
    camera->forward[i] = (float)forward[i];
    camera->up[i] = (float)up[i];
  }
  const float field = (float)looks->field;
  camera->frustum_center *= field;
  camera->frustum_bottom *= field;
  camera->frustum_top *= field;
}

static void change_looks(mjvScene* scene, const fs_looks* looks) {
  change_objects(scene, looks);
  for (int eye = 0; eye < 2; eye++) change_camera(scene->camera + eye, looks);
  for (int i = 0; i < scene->nlight; i++) {
    mjvLight* light = scene->lights + i;
    if (light->headlight) {
      memcpy(light->dir, scene->camera[0].forward, sizeof light->dir);
    } else {
      change_light(light, looks->light);
    }
  }
}

// --------------------------------------------------------------------------------------- pictures

static void add_goals(const fs_functions* mj, mjvScene* scene, const fs_goals* goals) {
  static const double size[3] = {0.02, 0.02, 0.02};
  static const double center[3] = {0, 0, 0};
  const float color[4] = {goals->color[0], goals->color[1], goals->color[2], 1};
  mjvGeom shown;
  mj->mjv_initGeom(&shown, mjGEOM_SPHERE, size, center, NULL, color);
  for (int i = 0; i < scene->ngeom; i++) {
    const mjvGeom* geom = scene->geoms + i;
    if (geom->objtype == mjOBJ_SITE && geom->objid == goals->site) shown = *geom;
  }
  if (goals->count > scene->maxgeom - scene->ngeom) fs_on_error("there are too many goals to draw");
  for (int i = 0; i < goals->count; i++) {
    shown.segid = scene->ngeom;
    for (int axis = 0; axis < 3; axis++) shown.pos[axis] = (float)goals->positions[3 * i + axis];
    scene->geoms[scene->ngeom++] = shown;
  }
}

static fs_status draw(fs_renderer* r, const mjModel* m, const mjData* d, const fs_goals* goals,
                      const fs_looks* looks, int segments, unsigned char* rgb, float* depth) {
  FS_GUARDED(NULL, {
    mj->mjr_setBuffer(mjFB_OFFSCREEN, &r->context);
    mj->mjv_updateScene(m, (mjData*)d, &r->option, &r->perturb, &r->camera, mjCAT_ALL, &r->scene);
    if (looks) change_looks(&r->scene, looks);
    if (goals->count > 0) add_goals(mj, &r->scene, goals);
    r->scene.flags[mjRND_SEGMENT] = r->scene.flags[mjRND_IDCOLOR] = (mjtByte)segments;
    mj->mjr_render(r->viewport, &r->scene, &r->context);
    mj->mjr_readPixels(rgb, depth, r->viewport, &r->context);
  });
}

fs_status fs_draw(fs_renderer* r, const mjModel* m, const mjData* d, const fs_goals* goals,
                  const fs_looks* looks, int segments, unsigned char* rgb, float* depth) {
  fs_gl_outer outer;
  if (fs_gl_enter(r->gl, &outer) != FS_OK) return FS_FAILED;
  const fs_status status = draw(r, m, d, goals, looks, segments, rgb, depth);
  fs_gl_leave(&outer);
  return status;
}

int fs_planes(const fs_renderer* r, float planes[2]) {
  const mjvGLCamera* camera = r->scene.camera;
  planes[0] = camera->frustum_near;
  planes[1] = camera->frustum_far;
#if mjVERSION_HEADER >= 320
  return camera->orthographic;
#else
  return 0;
#endif
}

int fs_segments(const fs_renderer* r, fs_segment* segments, int size) {
  for (int i = 0; i < size; i++) segments[i].kind = FS_BACKGROUND;
  for (int i = 0; i < r->scene.ngeom; i++) {
    const mjvGeom* geom = r->scene.geoms + i;
    if (geom->segid < 0 || geom->segid >= size) continue;
    segments[geom->segid] = (fs_segment){segment_kind(geom), geom->objid};
  }
  return r->scene.maxgeom;
}
