// Drawing a simulation off screen with MuJoCo's renderer.
//
// Rules that the Rust side relies on, besides those of fetch_shim.c:
// - fs_load_renderer must have succeeded before any other function is called.
// - A renderer is used and deleted on the thread that made it.
// - Nothing here changes a model or data, but for fs_prepare_model and fs_place.

#include <mujoco/mujoco.h>
#include <stdlib.h>

#include "fetch_shim.h"
#include "gl_context.h"

// ------------------------------------------------------------------------------------ the library

#define FS_FUNCTIONS(X)                                                                            \
  X(mj_name2id) X(mj_id2name) X(mj_kinematics) X(mj_comPos) X(mj_camlight)                         \
  X(mjv_defaultCamera) X(mjv_defaultOption) X(mjv_defaultPerturb) X(mjv_defaultScene)              \
  X(mjv_makeScene) X(mjv_freeScene) X(mjv_updateScene) X(mjr_defaultContext) X(mjr_makeContext)    \
  X(mjr_freeContext) X(mjr_setBuffer) X(mjr_render) X(mjr_readPixels)

static struct {
#define X(name) __typeof__(&name) name;
  FS_FUNCTIONS(X)
#undef X
} mj;

// Looks MuJoCo's functions up; once for the process, after fs_load.
int fs_load_renderer(void) {
#define X(name) if (!fs_symbol(fs_mujoco, #name, &mj.name)) return fs_fail("MuJoCo has no function " #name);
  FS_FUNCTIONS(X)
#undef X
  return FS_OK;
}

// --------------------------------------------------------------------------------- model and data

// Sets what a renderer reads from its model when it is made.
void fs_prepare_model(mjModel* m, int width, int height, int samples) {
  m->vis.global.offwidth = width;
  m->vis.global.offheight = height;
  m->vis.quality.offsamples = samples;
  m->vis.quality.shadowsize = 0;  // the light of the scenes casts none: 64 MB saved
}

typedef struct {
  const mjModel* m;
  mjData* d;
} place_arguments;

static void place(void* argument) {
  const place_arguments* at = argument;
  mj.mj_kinematics(at->m, at->d);
  mj.mj_comPos(at->m, at->d);
  mj.mj_camlight(at->m, at->d);
}

// Computes what is drawn from the positions in `d`: no velocities, forces or contacts.
int fs_place(const mjModel* m, mjData* d) {
  place_arguments arguments = {m, d};
  return fs_guarded(place, &arguments);
}

int fs_camera_count(const mjModel* m) { return (int)m->ncam; }

// The id of a named camera, or -1.
int fs_camera_id(const mjModel* m, const char* name) { return mj.mj_name2id(m, mjOBJ_CAMERA, name); }

// The name of a camera, or NULL. Valid as long as the model.
const char* fs_camera_name(const mjModel* m, int id) { return mj.mj_id2name(m, mjOBJ_CAMERA, id); }

// -------------------------------------------------------------------------------------- renderers

typedef struct {
  fs_gl* gl;
  mjrContext context;
  mjvScene scene;
  mjvOption option;
  mjvCamera camera;
  mjvPerturb perturb;
  mjrRect viewport;
} fs_renderer;

enum { SPARE_GEOMS = 1000 };  // for what the scene holds besides the model's geoms, such as sites

typedef struct {
  fs_renderer* renderer;
  const mjModel* m;
} make_arguments;

static void make(void* argument) {
  const make_arguments* to = argument;
  fs_renderer* r = to->renderer;
  mj.mjv_makeScene(to->m, &r->scene, SPARE_GEOMS + (int)to->m->ngeom);
  mj.mjr_makeContext(to->m, &r->context, mjFONTSCALE_50);
  mj.mjr_setBuffer(mjFB_OFFSCREEN, &r->context);
}

static void release(void* argument) {
  fs_renderer* r = argument;
  mj.mjr_freeContext(&r->context);
  mj.mjv_freeScene(&r->scene);
}

void fs_delete_renderer(fs_renderer* r) {
  // Without its context there is nothing of OpenGL left to be freed.
  if (fs_gl_make_current(r->gl) == FS_OK) fs_guarded(release, r);
  fs_gl_delete(r->gl);
  free(r);
}

// A renderer of a prepared model. *renderer stays NULL, with FS_FAILED, if there is no OpenGL
// (*has_gl is 0 then) or MuJoCo cannot use it.
int fs_make_renderer(const mjModel* m, fs_renderer** renderer, int* has_gl) {
  *renderer = NULL;
  fs_gl* gl = fs_gl_make();
  *has_gl = gl != NULL;
  if (!gl) return FS_FAILED;
  fs_renderer* r = calloc(1, sizeof *r);
  if (!r) {
    fs_gl_delete(gl);
    return fs_fail("no memory for a renderer");
  }
  r->gl = gl;
  r->viewport = (mjrRect){0, 0, m->vis.global.offwidth, m->vis.global.offheight};
  mj.mjv_defaultScene(&r->scene);
  mj.mjv_defaultOption(&r->option);
  mj.mjv_defaultCamera(&r->camera);
  mj.mjv_defaultPerturb(&r->perturb);
  mj.mjr_defaultContext(&r->context);
  make_arguments arguments = {r, m};
  int status = fs_guarded(make, &arguments);
  const mjrContext* made = &r->context;
  if (status == FS_OK && (made->offWidth != r->viewport.width || made->offHeight != r->viewport.height)) {
    status = fs_fail("OpenGL gave a framebuffer of %d x %d pixels", made->offWidth, made->offHeight);
  }
  if (status & FS_FAILED) {
    mj.mjv_freeScene(&r->scene);  // what is OpenGL's goes with its context
    fs_gl_delete(gl);
    free(r);
    return status;
  }
  *renderer = r;
  return status;
}

// A free camera: where it looks (meters), from how far, and from which direction (degrees).
void fs_set_free_camera(fs_renderer* r, const double lookat[3], double distance, double azimuth,
                        double elevation) {
  r->camera.type = mjCAMERA_FREE;
  r->camera.fixedcamid = -1;
  for (int i = 0; i < 3; i++) r->camera.lookat[i] = lookat[i];
  r->camera.distance = distance;
  r->camera.azimuth = azimuth;
  r->camera.elevation = elevation;
}

// A camera of the model.
void fs_set_fixed_camera(fs_renderer* r, int id) {
  r->camera.type = mjCAMERA_FIXED;
  r->camera.fixedcamid = id;
}

typedef struct {
  fs_renderer* renderer;
  const mjModel* m;
  mjData* d;
  int segments;
  unsigned char* rgb;
  float* depth;
} draw_arguments;

static void draw(void* argument) {
  const draw_arguments* to = argument;
  fs_renderer* r = to->renderer;
  mj.mjr_setBuffer(mjFB_OFFSCREEN, &r->context);
  mj.mjv_updateScene(to->m, to->d, &r->option, &r->perturb, &r->camera, mjCAT_ALL, &r->scene);
  r->scene.flags[mjRND_SEGMENT] = r->scene.flags[mjRND_IDCOLOR] = (mjtByte)to->segments;
  mj.mjr_render(r->viewport, &r->scene, &r->context);
  mj.mjr_readPixels(to->rgb, to->depth, r->viewport, &r->context);
}

// Draws placed data, of which nothing changes, and reads the picture: width x height pixels, the
// bottom row first. `rgb` and `depth` (from 0, near, to 1, far) may be NULL. With `segments` a
// pixel's number, red + 256 green + 65536 blue, is 0 for the background and else 1 + the index of what
// fs_segments tells.
int fs_draw(fs_renderer* r, const mjModel* m, const mjData* d, int segments, unsigned char* rgb,
            float* depth) {
  if (fs_gl_make_current(r->gl) != FS_OK) return FS_FAILED;
  draw_arguments arguments = {r, m, (mjData*)d, segments, rgb, depth};
  return fs_guarded(draw, &arguments);
}

// The distances of the near and the far plane in the last picture (meters), and whether its camera
// projects in parallel.
void fs_planes(const fs_renderer* r, float* near_plane, float* far_plane, int* parallel) {
  const mjvGLCamera* camera = r->scene.camera;
  *near_plane = camera->frustum_near;
  *far_plane = camera->frustum_far;
#if mjVERSION_HEADER >= 310
  *parallel = camera->orthographic;
#else
  *parallel = 0;
#endif
}

enum { FS_NO_SEGMENT, FS_GEOM, FS_SITE, FS_OTHER };

// Writes kind and id of the objects of the last picture, by index; returns how many there may be.
int fs_segments(const fs_renderer* r, int (*segments)[2], int size) {
  for (int i = 0; i < size; i++) segments[i][0] = FS_NO_SEGMENT;
  for (int i = 0; i < r->scene.ngeom; i++) {
    const mjvGeom* geom = r->scene.geoms + i;
    if (geom->segid < 0 || geom->segid >= size) continue;
    int* segment = segments[geom->segid];
    segment[0] = geom->objtype == mjOBJ_GEOM ? FS_GEOM : geom->objtype == mjOBJ_SITE ? FS_SITE : FS_OTHER;
    segment[1] = geom->objid;
  }
  return r->scene.maxgeom;
}
