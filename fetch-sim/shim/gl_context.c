// Two libraries provide OpenGL without a window: EGL (from a driver, or Mesa in software) and OSMesa
// (only in software). The first that works is used for the rest of the process, because MuJoCo looks
// up its OpenGL functions once, in the library that is loaded then. As in MuJoCo's own bindings, the
// environment variable MUJOCO_GL may name the one to use (egl, osmesa), or none (disable).
// A thread may have a context of either library, whichever was chosen. Both libraries keep what they
// draw with in the same place, so that leaving a context of one takes the other's away: each is made
// current again by its own library.
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

typedef struct fs_gl_library {
  const char* name;
  int (*find)(int flags);  // opens the library with these flags of dlopen, unless it has been found
  int (*choose)(void);     // returns 0 if it cannot make contexts
  void* (*create)(void);
  int (*make_current)(fs_gl*);
  void (*release)(void);  // leaves no context of ours current
  void (*destroy)(void* context);
  int (*save)(fs_gl_outer*);  // returns 0 if none of its contexts is current on this thread
  void (*restore)(const fs_gl_outer*);
} gl_library;

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
  int found;
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

static int egl_find(int flags) {
  if (egl.found) return 1;
  void* library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL | flags);
  if (!library) return 0;
#define EGL(name) fs_symbol(library, "egl" #name, &egl.name)
  egl.found = EGL(GetProcAddress) && EGL(Initialize) && EGL(BindAPI) && EGL(QueryAPI) &&
              EGL(ChooseConfig) && EGL(CreateContext) && EGL(MakeCurrent) && EGL(DestroyContext) &&
              EGL(GetCurrentContext) && EGL(GetCurrentDisplay) && EGL(GetCurrentSurface);
#undef EGL
  return egl.found;
}

static int egl_choose(void) {
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

static void egl_release(void) { egl.MakeCurrent(egl.display, NULL, NULL, NULL); }

static int egl_save(fs_gl_outer* outer) {
  outer->egl_api = outer->type = egl.QueryAPI();
  outer->context = egl.GetCurrentContext();
  if (!outer->context && egl.BindAPI(EGL_OPENGL_API)) {
    outer->type = EGL_OPENGL_API;
    outer->context = egl.GetCurrentContext();
  }
  if (!outer->context) return 0;
  outer->display = egl.GetCurrentDisplay();
  outer->draw = egl.GetCurrentSurface(EGL_DRAW);
  outer->read = egl.GetCurrentSurface(EGL_READ);
  return 1;
}

static void egl_restore(const fs_gl_outer* outer) {
  egl.BindAPI(outer->type);
  // EGL does nothing for a context that it believes to be current.
  egl.MakeCurrent(outer->display, NULL, NULL, NULL);
  egl.MakeCurrent(outer->display, outer->draw, outer->read, outer->context);
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
  int found;
} osmesa;

static int osmesa_find(int flags) {
  if (osmesa.found) return 1;
  // Global, because MuJoCo searches all libraries for the function OSMesaGetProcAddress.
  void* library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_GLOBAL | flags);
  if (!library) library = dlopen("libOSMesa.so.6", RTLD_NOW | RTLD_GLOBAL | flags);
  if (!library) return 0;
#define OSMESA(name) fs_symbol(library, "OSMesa" #name, &osmesa.name)
  osmesa.found = OSMESA(CreateContextExt) && OSMESA(MakeCurrent) && OSMESA(DestroyContext) &&
                 OSMESA(GetCurrentContext) && OSMESA(GetColorBuffer) && OSMESA(GetIntegerv);
#undef OSMESA
  return osmesa.found;
}

static int osmesa_choose(void) { return 1; }

static void* osmesa_create(void) { return osmesa.CreateContextExt(OSMESA_RGBA, 24, 8, 0, NULL); }

static int osmesa_make_current(fs_gl* gl) {
  return osmesa.MakeCurrent(gl->context, gl->pixels, OSMESA_UNSIGNED_BYTE, 16, 16);
}

static void osmesa_destroy(void* context) { osmesa.DestroyContext(context); }

static void osmesa_release(void) { osmesa.MakeCurrent(NULL, NULL, OSMESA_UNSIGNED_BYTE, 0, 0); }

static int osmesa_save(fs_gl_outer* outer) {
  outer->context = osmesa.GetCurrentContext();
  if (!outer->context) return 0;
  int format, type = OSMESA_UNSIGNED_BYTE;
  osmesa.GetColorBuffer(outer->context, &outer->width, &outer->height, &format, &outer->draw);
  osmesa.GetIntegerv(OSMESA_TYPE, &type);
  outer->type = (unsigned)type;
  return 1;
}

static void osmesa_restore(const fs_gl_outer* outer) {
  osmesa.MakeCurrent(outer->context, outer->draw, outer->type, outer->width, outer->height);
}

// --------------------------------------------------------------------------------------- the choice

static const gl_library libraries[] = {
    {"EGL", egl_find, egl_choose, egl_create, egl_make_current, egl_release, egl_destroy, egl_save,
     egl_restore},
    {"OSMesa", osmesa_find, osmesa_choose, osmesa_create, osmesa_make_current, osmesa_release,
     osmesa_destroy, osmesa_save, osmesa_restore},
};
enum { LIBRARIES = sizeof libraries / sizeof *libraries };

static const gl_library* chosen;
static pthread_once_t choose_once = PTHREAD_ONCE_INIT;

// Held while a context of ours is current, and while one is made or deleted. Mesa 22.3 sometimes
// crashes if one thread changes its current context while another draws, with EGL and with OSMesa.
static pthread_mutex_t drawing = PTHREAD_MUTEX_INITIALIZER;

static void save(fs_gl_outer* outer) {
  *outer = (fs_gl_outer){0};
  // OSMesa takes any current context for its own, so EGL is asked first.
  for (int i = 0; i < LIBRARIES && !outer->library; i++) {
    if (libraries[i].find(RTLD_NOLOAD) && libraries[i].save(outer)) outer->library = libraries + i;
  }
}

static void restore(const gl_library* ours, const fs_gl_outer* outer) {
  ours->release();
  if (outer->library) outer->library->restore(outer);
  if (outer->egl_api) egl.BindAPI(outer->egl_api);
}

static fs_gl* make_with(const gl_library* library, fs_gl_outer* outer) {
  fs_gl* gl = calloc(1, sizeof *gl);
  if (!gl) return NULL;
  save(outer);
  gl->context = library->create();
  if (gl->context && library->make_current(gl)) return gl;
  restore(library, outer);
  if (gl->context) library->destroy(gl->context);
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
  for (int i = 0; !chosen && i < LIBRARIES; i++) {
    const gl_library* library = libraries + i;
    if (wished && strcasecmp(wish, library->name) != 0) continue;
    if (!library->find(0) || !library->choose()) continue;
    fs_gl_outer outer;
    fs_gl* trial = make_with(library, &outer);
    if (!trial) continue;
    chosen = library;
    restore(chosen, &outer);
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
  save(outer);
  if (chosen->make_current(gl)) return FS_OK;
  fs_gl_leave(outer);
  return fs_fail("%s could not make its context current", chosen->name);
}

void fs_gl_leave(const fs_gl_outer* outer) {
  restore(chosen, outer);
  pthread_mutex_unlock(&drawing);
}

void fs_gl_delete(fs_gl* gl) {
  pthread_mutex_lock(&drawing);
  delete(gl);
  pthread_mutex_unlock(&drawing);
}

const char* fs_gl_backend(void) { return chosen ? chosen->name : NULL; }
