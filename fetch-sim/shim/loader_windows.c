// The loader of Windows.

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <string.h>

#include "internal.h"

enum { PATH_SIZE = 4096 };  // in UTF-16 units, and thrice as many bytes

// Converts UTF-8; returns 0 if the text is not UTF-8, or too long.
static int widen(const char* text, wchar_t wide[PATH_SIZE]) {
  return MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text, -1, wide, PATH_SIZE);
}

void* fs_open(const char* path) {
  wchar_t wide[PATH_SIZE];
  if (!widen(path, wide)) {
    fs_fail("the path is not Unicode, or too long");
    return NULL;
  }
  // No dialog about a damaged file. What the library needs may lie beside it, and is looked for in
  // neither the current folder nor PATH.
  DWORD mode;
  SetThreadErrorMode(SEM_FAILCRITICALERRORS, &mode);
  const DWORD flags = LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR | LOAD_LIBRARY_SEARCH_DEFAULT_DIRS;
  void* library = LoadLibraryExW(wide, NULL, flags);
  const DWORD error = GetLastError();
  SetThreadErrorMode(mode, NULL);
  if (library) return library;
  char text[256] = "";
  const DWORD how = FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS;
  const DWORD length = FormatMessageA(how, NULL, error, 0, text, sizeof text, NULL);
  for (DWORD i = length; i > 0 && strchr("\r\n. ", text[i - 1]); i--) text[i - 1] = '\0';
  fs_fail("%s (error %lu)", length ? text : "it cannot be loaded", error);
  return NULL;
}

void* fs_find_opened(const char* name) {
  wchar_t wide[PATH_SIZE];
  HMODULE library;
  return widen(name, wide) && GetModuleHandleExW(0, wide, &library) ? library : NULL;
}

void fs_close(void* library) { FreeLibrary(library); }

int fs_symbol(void* library, const char* name, void* target) {
  FARPROC symbol = GetProcAddress(library, name);
  memcpy(target, &symbol, sizeof symbol);
  return symbol != NULL;
}

// Libraries share no symbols.
void* fs_global_symbol(const char* name) {
  (void)name;
  return NULL;
}

// Returns the library at an address, or NULL. With GET_MODULE_HANDLE_EX_FLAG_PIN it stays for good.
static HMODULE library_at(const void* address, DWORD flags) {
  HMODULE library;
  flags |= GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS;
  return address && GetModuleHandleExW(flags, address, &library) ? library : NULL;
}

// A library's handle is its address.
const void* fs_base_of(const void* address) {
  return library_at(address, GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT);
}

void fs_keep(const void* address) { library_at(address, GET_MODULE_HANDLE_EX_FLAG_PIN); }

const char* fs_path_of(const void* address) {
  static _Thread_local char path[3 * PATH_SIZE];
  wchar_t wide[PATH_SIZE];
  const HMODULE library = library_at(address, GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT);
  if (!library) return NULL;
  const DWORD length = GetModuleFileNameW(library, wide, PATH_SIZE);
  if (length == 0 || length == PATH_SIZE) return NULL;
  return WideCharToMultiByte(CP_UTF8, 0, wide, -1, path, sizeof path, NULL, NULL) ? path : NULL;
}
