// The loader of Linux, macOS and other Unix systems.

#define _GNU_SOURCE  // dladdr
#include <dlfcn.h>
#include <string.h>

#include "internal.h"

void* fs_open(const char* path) {
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) fs_fail("%s", dlerror());
  return library;
}

void* fs_find_opened(const char* name) { return dlopen(name, RTLD_NOW | RTLD_NOLOAD); }

void fs_close(void* library) { dlclose(library); }

int fs_symbol(void* library, const char* name, void* target) {
  void* symbol = dlsym(library, name);
  memcpy(target, &symbol, sizeof symbol);
  return symbol != NULL;
}

void* fs_global_symbol(const char* name) { return dlsym(RTLD_DEFAULT, name); }

const char* fs_path_of(const void* address) {
  Dl_info info;
  return address && dladdr(address, &info) ? info.dli_fname : NULL;
}

const void* fs_base_of(const void* address) {
  Dl_info info;
  return dladdr(address, &info) ? info.dli_fbase : NULL;
}

void fs_keep(const void* address) {
  Dl_info info;
  if (dladdr(address, &info)) dlopen(info.dli_fname, RTLD_NOW | RTLD_NOLOAD | RTLD_NODELETE);
}
