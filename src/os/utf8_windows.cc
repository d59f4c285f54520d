// Texts of a program are UTF-8, on Windows too: the words of its command line, and what it makes
// paths of.
#include <cerrno>
#include <cwchar>
#include <string>
#include <vector>

#include "os/terminal.h"
#include "os/win32.h"

namespace upswing {
namespace {

/// Number of bytes of the character that begins with `first`; 0: none does.
int LengthOf(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return 2;
  if (first >= 0xe0 && first < 0xf0) return 3;
  return first >= 0xf0 && first < 0xf5 ? 4 : 0;
}

}  // namespace

char** Utf8Words(int /*argc*/, char** /*argv*/) {
  static std::vector<std::string> texts;
  static std::vector<char*> words;
  int count = 0;
  wchar_t** wide = CommandLineToArgvW(GetCommandLineW(), &count);
  for (int i = 0; i < count; ++i) texts.push_back(win32::Narrow(wide[i]));
  LocalFree(wide);
  for (std::string& text : texts) words.push_back(text.data());
  words.push_back(nullptr);
  return words.data();
}

}  // namespace upswing

// std::filesystem::path converts a std::string by this function of the C library, which knows no
// UTF-8. A character outside the 16 bits of wchar_t takes two calls: the first uses three of its
// four bytes and leaves the second half in `state`.
extern "C" size_t mbrtowc(wchar_t* to, const char* from, size_t size, mbstate_t* state) {
  static mbstate_t own{};
  if (state == nullptr) state = &own;
  if (from == nullptr || size == 0) return from == nullptr ? 0 : static_cast<size_t>(-2);
  wchar_t ignored = 0;
  if (to == nullptr) to = &ignored;
  if (*state != 0) {
    *to = static_cast<wchar_t>(*state);
    *state = 0;
    return 1;
  }
  const auto first = static_cast<unsigned char>(*from);
  const int length = upswing::LengthOf(first);
  if (length == 0) {
    errno = EILSEQ;
    return static_cast<size_t>(-1);
  }
  if (size < static_cast<size_t>(length)) return static_cast<size_t>(-2);
  wchar_t units[2] = {};
  const int count = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, from, length, units, 2);
  if (count == 0) {
    errno = EILSEQ;
    return static_cast<size_t>(-1);
  }
  *to = units[0];
  if (units[0] == L'\0') return 0;
  if (count == 1) return static_cast<size_t>(length);
  *state = units[1];
  return static_cast<size_t>(length - 1);
}
