// Loads MuJoCo's library at run time, and describes the contract.

#include <dlfcn.h>
#include <string.h>

#include "internal.h"

fs_functions fs_mj;

int fs_symbol(void* library, const char* name, void* target) {
  void* symbol = dlsym(library, name);
  memcpy(target, &symbol, sizeof symbol);
  return symbol != NULL;
}

int fs_contract(int index, const char** name, long long* value, size_t* size) {
  static const struct {
    const char* name;
    long long value;
    size_t size;
  } items[] = {
#define NUMBER(number, ...) {#number, number, sizeof(int)},
#define FIELD(s, type, field, ...) {#s "." #field, offsetof(s, field), sizeof((s*)0)->field},
#define STRUCT(s, FIELDS) {#s, 0, sizeof(s)}, FIELDS(FIELD, s)
      FS_NUMBERS(NUMBER) FS_STRUCTS(STRUCT)
  };
  if (index < 0 || (size_t)index >= sizeof items / sizeof *items) return 0;
  *name = items[index].name;
  *value = items[index].value;
  *size = items[index].size;
  return 1;
}

int fs_header_version(void) { return mjVERSION_HEADER; }

fs_status fs_load(const char* path, const char* plugins, int* version) {
  *version = 0;
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) return fs_fail("%s", dlerror());
  if (!fs_symbol(library, "mj_version", &fs_mj.mj_version)) return fs_fail("it has no function mj_version");
  *version = fs_mj.mj_version();
  if (*version != mjVERSION_HEADER) return fs_fail("the versions differ");
#define X(name) if (!fs_symbol(library, #name, &fs_mj.name)) return fs_fail("it has no function " #name);
  FS_FUNCTIONS(X)
#undef X
#define X(result, field, arguments, name)                                                          \
  if (!fs_symbol(library, name, &fs_mj.field)) return fs_fail("it has no function " name);
  FS_HOOKS(X)
#undef X
  void (*load_plugins)(const char*, void*);
  if (plugins && fs_symbol(library, "mj_loadAllPluginLibraries", &load_plugins)) {
    load_plugins(plugins, NULL);
  }
  fs_install_filter(library);
  return FS_OK;
}
