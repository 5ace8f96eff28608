// Two libraries provide OpenGL without a window: EGL (from a driver, or Mesa in software) and OSMesa
// (only in software). The first that works is used for the rest of the process, because MuJoCo looks
// up its OpenGL functions once, in the library that is loaded then. As in MuJoCo's own bindings, the
// environment variable MUJOCO_GL may name the one to use (egl, osmesa), or none (disable).
// The few declarations below, from the Khronos registry and Mesa, replace the headers of OpenGL.

#include "internal.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct fs_gl {
  void* context;
  unsigned char pixels[4 * 16 * 16];  // OSMesa requires a surface; nothing is drawn to it
};

typedef struct {
  const char* name;
  int (*load)(void);
  void* (*create)(void);
  int (*make_current)(fs_gl*);
  void (*destroy)(void* context);
  void (*save)(fs_gl_outer*);
  void (*restore)(const fs_gl_outer*);
} backend;

// ------------------------------------------------------------------------------------------- EGL

enum {
  EGL_ALPHA_SIZE = 0x3021, EGL_BLUE_SIZE = 0x3022, EGL_GREEN_SIZE = 0x3023, EGL_RED_SIZE = 0x3024,
  EGL_DEPTH_SIZE = 0x3025, EGL_STENCIL_SIZE = 0x3026, EGL_SURFACE_TYPE = 0x3033,
  EGL_NONE = 0x3038, EGL_RENDERABLE_TYPE = 0x3040, EGL_PBUFFER_BIT = 0x0001, EGL_OPENGL_BIT = 0x0008,
  EGL_DRAW = 0x3059, EGL_READ = 0x305A,
  EGL_OPENGL_API = 0x30A2, EGL_PLATFORM_SURFACELESS = 0x31DD, EGL_PLATFORM_DEVICE = 0x313F,
  EGL_MAX_DEVICES = 16
};

static struct {
  void* (*GetProcAddress)(const char*);
  unsigned (*Initialize)(void* display, int* major, int* minor);
  unsigned (*BindAPI)(unsigned api);
  unsigned (*QueryAPI)(void);
  unsigned (*ChooseConfig)(void* display, const int* wanted, void** configs, int size, int* count);
  void* (*CreateContext)(void* display, void* config, void* shared, const int* attributes);
  unsigned (*MakeCurrent)(void* display, void* draw, void* read, void* context);
  unsigned (*DestroyContext)(void* display, void* context);
  void* (*GetCurrentContext)(void);
  void* (*GetCurrentDisplay)(void);
  void* (*GetCurrentSurface)(int which);
  void* (*GetPlatformDisplay)(unsigned platform, void* native, const int* attributes);
  unsigned (*QueryDevices)(int size, void** devices, int* count);
  void* display;
  void* config;
} egl;

// Selects a display if it can be initialized and has desktop OpenGL.
static int egl_use(void* display) {
  static const int wanted[] = {
      EGL_RED_SIZE, 8, EGL_GREEN_SIZE, 8, EGL_BLUE_SIZE, 8, EGL_ALPHA_SIZE, 8, EGL_DEPTH_SIZE, 24,
      EGL_STENCIL_SIZE, 8, EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
      EGL_NONE,
  };
  int major, minor, count = 0;
  if (!display || !egl.Initialize(display, &major, &minor)) return 0;
  if (!egl.ChooseConfig(display, wanted, &egl.config, 1, &count) || count < 1) return 0;
  egl.display = display;
  return 1;
}

static int egl_load(void) {
  void* library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
  if (!library) return 0;
#define EGL(name) fs_symbol(library, "egl" #name, &egl.name)
  const int complete = EGL(GetProcAddress) && EGL(Initialize) && EGL(BindAPI) && EGL(QueryAPI) &&
                       EGL(ChooseConfig) && EGL(CreateContext) && EGL(MakeCurrent) &&
                       EGL(DestroyContext) && EGL(GetCurrentContext) && EGL(GetCurrentDisplay) &&
                       EGL(GetCurrentSurface);
#undef EGL
  if (!complete) return 0;
  void* symbol = egl.GetProcAddress("eglGetPlatformDisplayEXT");
  if (!symbol) return 0;
  memcpy(&egl.GetPlatformDisplay, &symbol, sizeof symbol);
  if (egl_use(egl.GetPlatformDisplay(EGL_PLATFORM_SURFACELESS, NULL, NULL))) return 1;
  // Drivers other than Mesa's lack this platform, but have displays for their devices.
  symbol = egl.GetProcAddress("eglQueryDevicesEXT");
  if (!symbol) return 0;
  memcpy(&egl.QueryDevices, &symbol, sizeof symbol);
  void* devices[EGL_MAX_DEVICES];
  int count = 0;
  if (!egl.QueryDevices(EGL_MAX_DEVICES, devices, &count)) return 0;
  for (int i = 0; i < count; i++) {
    if (egl_use(egl.GetPlatformDisplay(EGL_PLATFORM_DEVICE, devices[i], NULL))) return 1;
  }
  return 0;
}

static void* egl_create(void) {
  if (!egl.BindAPI(EGL_OPENGL_API)) return NULL;
  return egl.CreateContext(egl.display, egl.config, NULL, NULL);
}

static int egl_make_current(fs_gl* gl) {
  return egl.BindAPI(EGL_OPENGL_API) && egl.MakeCurrent(egl.display, NULL, NULL, gl->context);
}

static void egl_destroy(void* context) { egl.DestroyContext(egl.display, context); }

static void egl_save(fs_gl_outer* outer) {
  outer->api = egl.QueryAPI();
  outer->context = egl.GetCurrentContext();
  if (!outer->context && egl.BindAPI(EGL_OPENGL_API)) outer->context = egl.GetCurrentContext();
  if (!outer->context) return;
  outer->display = egl.GetCurrentDisplay();
  outer->draw = egl.GetCurrentSurface(EGL_DRAW);
  outer->read = egl.GetCurrentSurface(EGL_READ);
}

static void egl_restore(const fs_gl_outer* outer) {
  void* display = outer->context ? outer->display : egl.display;
  egl.MakeCurrent(display, outer->draw, outer->read, outer->context);
  egl.BindAPI(outer->api);
}

// ---------------------------------------------------------------------------------------- OSMesa

enum { OSMESA_RGBA = 0x1908, OSMESA_UNSIGNED_BYTE = 0x1401, OSMESA_TYPE = 0x23 };

static struct {
  void* (*CreateContextExt)(unsigned format, int depth, int stencil, int accumulation, void* shared);
  unsigned char (*MakeCurrent)(void* context, void* pixels, unsigned type, int width, int height);
  void (*DestroyContext)(void* context);
  void* (*GetCurrentContext)(void);
  unsigned char (*GetColorBuffer)(void* context, int* width, int* height, int* format, void** pixels);
  void (*GetIntegerv)(int name, int* value);
} osmesa;

static int osmesa_load(void) {
  // Global, because MuJoCo searches all libraries for the function OSMesaGetProcAddress.
  void* library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_GLOBAL);
  if (!library) library = dlopen("libOSMesa.so.6", RTLD_NOW | RTLD_GLOBAL);
#define OSMESA(name) fs_symbol(library, "OSMesa" #name, &osmesa.name)
  return library && OSMESA(CreateContextExt) && OSMESA(MakeCurrent) && OSMESA(DestroyContext) &&
         OSMESA(GetCurrentContext) && OSMESA(GetColorBuffer) && OSMESA(GetIntegerv);
#undef OSMESA
}

static void* osmesa_create(void) { return osmesa.CreateContextExt(OSMESA_RGBA, 24, 8, 0, NULL); }

static int osmesa_make_current(fs_gl* gl) {
  return osmesa.MakeCurrent(gl->context, gl->pixels, OSMESA_UNSIGNED_BYTE, 16, 16);
}

static void osmesa_destroy(void* context) { osmesa.DestroyContext(context); }

static void osmesa_save(fs_gl_outer* outer) {
  outer->context = osmesa.GetCurrentContext();
  if (!outer->context) return;
  int format, type = OSMESA_UNSIGNED_BYTE;
  osmesa.GetColorBuffer(outer->context, &outer->width, &outer->height, &format, &outer->draw);
  osmesa.GetIntegerv(OSMESA_TYPE, &type);
  outer->api = (unsigned)type;
}

static void osmesa_restore(const fs_gl_outer* outer) {
  osmesa.MakeCurrent(outer->context, outer->draw, outer->api, outer->width, outer->height);
}

// --------------------------------------------------------------------------------------- the choice

static const backend backends[] = {
    {"EGL", egl_load, egl_create, egl_make_current, egl_destroy, egl_save, egl_restore},
    {"OSMesa", osmesa_load, osmesa_create, osmesa_make_current, osmesa_destroy, osmesa_save,
     osmesa_restore},
};

static const backend* chosen;
static pthread_once_t choose_once = PTHREAD_ONCE_INIT;

// Held while a context of ours is current, and while one is made or deleted. Mesa 22.3 sometimes
// crashes if one thread changes its current context while another draws, with EGL and with OSMesa.
static pthread_mutex_t drawing = PTHREAD_MUTEX_INITIALIZER;

static fs_gl* make_with(const backend* from, fs_gl_outer* outer) {
  fs_gl* gl = calloc(1, sizeof *gl);
  if (!gl) return NULL;
  *outer = (fs_gl_outer){0};
  from->save(outer);
  gl->context = from->create();
  if (gl->context && from->make_current(gl)) return gl;
  from->restore(outer);
  if (gl->context) from->destroy(gl->context);
  free(gl);
  return NULL;
}

static void delete(fs_gl* gl) {
  chosen->destroy(gl->context);
  free(gl);
}

// A library that loads may still provide no context, so the choice makes one and makes it current.
static void choose(void) {
  const char* wish = getenv("MUJOCO_GL");
  if (!wish) wish = "";
  const int wished = strcasecmp(wish, "egl") == 0 || strcasecmp(wish, "osmesa") == 0;
  if (strcasecmp(wish, "disable") == 0) return;
  for (size_t i = 0; !chosen && i < sizeof backends / sizeof *backends; i++) {
    if ((wished && strcasecmp(wish, backends[i].name) != 0) || !backends[i].load()) continue;
    fs_gl_outer outer;
    fs_gl* trial = make_with(backends + i, &outer);
    if (!trial) continue;
    chosen = backends + i;
    chosen->restore(&outer);
    delete(trial);
  }
}

fs_gl* fs_gl_make(fs_gl_outer* outer) {
  pthread_mutex_lock(&drawing);
  pthread_once(&choose_once, choose);
  fs_gl* gl = chosen ? make_with(chosen, outer) : NULL;
  if (!gl) pthread_mutex_unlock(&drawing);
  const char* wish = getenv("MUJOCO_GL");
  if (!gl && chosen) {
    fs_fail("%s provided no OpenGL context", chosen->name);
  } else if (!gl && wish) {
    fs_fail("MUJOCO_GL is %s, and no library that it allows works", wish);
  } else if (!gl) {
    fs_fail("libEGL.so.1 and libOSMesa.so.8 are missing or do not work");
  }
  return gl;
}

fs_status fs_gl_enter(fs_gl* gl, fs_gl_outer* outer) {
  pthread_mutex_lock(&drawing);
  *outer = (fs_gl_outer){0};
  chosen->save(outer);
  if (chosen->make_current(gl)) return FS_OK;
  fs_gl_leave(outer);
  return fs_fail("%s could not make its context current", chosen->name);
}

void fs_gl_leave(const fs_gl_outer* outer) {
  chosen->restore(outer);
  pthread_mutex_unlock(&drawing);
}

void fs_gl_delete(fs_gl* gl) {
  pthread_mutex_lock(&drawing);
  delete(gl);
  pthread_mutex_unlock(&drawing);
}

const char* fs_gl_backend(void) { return chosen ? chosen->name : NULL; }
